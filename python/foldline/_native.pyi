"""The half of the package that is written in Rust. Arrays are passed as bytes."""

import os
from collections.abc import Callable, Mapping
from typing import Any

class Model:
    text: str
    file: str
    name: str
    description: str
    parameters: list[tuple[tuple[str, str, str], float]]
    states: list[tuple[tuple[str, str, str], tuple[float | None, tuple[float, float] | None, float | None]]]
    outputs: list[tuple[str, str, str]]
    whirl: tuple[int, int] | None
    forced: bool
    time: str
    remarks: list[str]
    @staticmethod
    def parse(text: str, file: str) -> Model: ...
    @staticmethod
    def read(path: str | os.PathLike[str]) -> Model: ...
    def time_unit(self, parameters: bytes) -> float: ...
    def values(self, given: list[tuple[str, float]]) -> bytes: ...
    def evaluate(self, states: bytes, parameters: bytes, times: bytes, outputs: bool) -> bytes: ...

class Solution:
    position: int
    family: str
    period: float | None
    forcing_periods: int
    turns: list[tuple[str, int]]
    unstable: int
    trust: tuple[float, float, float, float, float]
    ratio: tuple[int, int] | None
    def parameters(self) -> bytes: ...
    def state(self) -> bytes: ...
    def spectrum(self) -> bytes: ...
    def ranges(self) -> bytes: ...
    def cost(self) -> bytes: ...
    def mesh(self) -> bytes: ...
    def profile(self) -> tuple[bytes, int]: ...
    def node_times(self) -> bytes: ...
    def uniform(self, count: int) -> bytes: ...
    def signed_spectrum(self, count: int) -> tuple[bytes, bytes]: ...

class Study:
    text: str
    file: str
    tolerance: float
    degree: int
    @staticmethod
    def parse(text: str, file: str, model: Model) -> Study: ...
    @staticmethod
    def parse_text(text: str, file: str) -> Study: ...
    @staticmethod
    def read(path: str | os.PathLike[str]) -> Study: ...
    def limited(self, steps: int | None, time: str | None) -> Study: ...
    def model(self) -> Model: ...
    def range_of(self, branch: str) -> tuple[float, float] | None: ...
    def is_leg(self, branch: str) -> bool: ...

class Diagram:
    notes: list[tuple[str, str]]
    @staticmethod
    def load(folder: str | os.PathLike[str]) -> Diagram: ...
    def save(self, folder: str | os.PathLike[str]) -> None: ...
    def study(self) -> Study: ...
    def in_units(self, units: list[tuple[str, str]]) -> Diagram: ...
    def short(self) -> list[str]: ...
    def maps(self) -> list[tuple[str, list[dict[str, Any]]]]: ...
    def answer(
        self, short: list[str]
    ) -> tuple[tuple[dict[str, Any], list[tuple[str, dict[str, Any]]], str, dict[str, Any]] | None, str]: ...
    def branches(self) -> list[dict[str, Any]]: ...
    def column(self, branch: int, special: bool, name: str) -> bytes: ...
    def quantity(self, branch: int, special: bool, name: str) -> bytes | None: ...
    def special(self, branch: int) -> list[tuple[str, int, int, float, tuple[list[float], list[float]], str | None, str]]: ...
    def solution(self, branch: int, special: bool, index: int) -> Solution: ...
    def only(self, branch: int, name: str) -> Diagram: ...
    def arrival(self, homotopy: str) -> Solution | None: ...
    def responses(self) -> list[dict[str, Any]]: ...
    def designs(self) -> list[dict[str, Any]]: ...
    def sensitivities(
        self, branch: int, special: bool, index: int
    ) -> list[tuple[str, str, float, list[tuple[str, tuple[float, float] | None, str]]]]: ...
    def uncertainty(
        self, branch: int, index: int, spreads: Mapping[str, tuple[float, float | None]], samples: int
    ) -> tuple[list[tuple[Any, ...]], list[tuple[str, int]]]: ...

def settle(
    model: Model,
    attractor: str | None,
    state: bytes,
    parameters: bytes,
    samples: int,
    random: int,
    tolerance: float,
    jobs: int,
    limits: tuple[int | None, float | None],
) -> Solution: ...
def attractors(
    model: Model,
    parameters: bytes,
    samples: int,
    seed: int,
    tolerance: float,
    jobs: int,
    limits: tuple[int | None, float | None],
) -> tuple[list[tuple[Solution, tuple[int, int] | None, int, tuple[float, float, float] | None, bytes]], tuple[int, int, int]]: ...
def simulate(
    model: Model,
    start: bytes,
    span: tuple[float, float],
    times: bytes | None,
    parameters: bytes,
    tolerance: float,
) -> tuple[tuple[bytes, bytes, bytes, str], BaseException | None]: ...
def basins(
    model: Model,
    parameters: bytes,
    ranges: bytes,
    plane: tuple[tuple[int, int], tuple[int, int], bytes] | None,
    samples: int,
    seed: int,
    tolerance: float,
    jobs: int,
    limits: tuple[int | None, float | None],
    adaptive: int | None,
) -> tuple[
    list[tuple[Solution, tuple[int, int] | None]],
    bytes,
    bytes,
    bytes,
    tuple[list[float | None], int, int] | None,
    bytes,
    tuple[bytes, int, int] | None,
]: ...
def motions(
    model: Model,
    parameters: bytes,
    shares: bool,
    samples: int,
    seed: int,
    tolerance: float,
    limits: tuple[int | None, float | None],
) -> tuple[dict[str, Any], list[tuple[str, dict[str, Any]]], str, dict[str, Any]]: ...
def ensemble(
    model: Model,
    starts: bytes,
    parameters: bytes,
    own: bool,
    span: tuple[float, float],
    scales: bytes,
    tolerance: float,
    steps: int,
    jobs: int,
) -> tuple[tuple[bytes, bytes, bytes, bytes, bytes], BaseException | None]: ...

class Emitted:
    source: str
    states: int
    scalars: int
    layout: list[tuple[str, str]]
    def __init__(self, model: Model, own: bool, settle: bool, section: bool) -> None: ...
    def values(self, parameters: bytes) -> bytes: ...

def run(
    study: Study,
    given: Mapping[str, Solution],
    earlier: Diagram | None,
    folder: str | os.PathLike[str] | None,
    jobs: int | None,
    resume: bool,
    progress: Callable[[int, int, str], None] | None,
) -> tuple[Diagram | None, list[str], BaseException | None]: ...
def marker(kind: str) -> str: ...
def label(model: Model, name: str) -> str: ...
def pieces(of: Diagram, branch: int, x: str, y: str, scale: tuple[float, float]) -> list[tuple[bool, bytes, bytes]]: ...
def svg(of: Diagram, branches: list[int], x: str, y: str, size: tuple[float, float]) -> str: ...
def suggest(word: str, known: list[str]) -> str: ...
