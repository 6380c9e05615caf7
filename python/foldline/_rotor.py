"""Rotors from matrices, or from the rotor of another program, as the text of a model file."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import ArgumentError
from ._model import Model, model
from ._write import value

#: Lateral degrees of freedom among the six of a node: x, y, and rotations about x and y.
_LATERAL = {4: (0, 1, 2, 3), 6: (0, 1, 3, 4)}


def _matrix(name: str, own: Any, size: int | None = None) -> np.ndarray:
    array = np.asarray(own, dtype=float)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or (size is not None and array.shape[0] != size):
        wanted = "a square matrix" if size is None else f"a matrix of shape ({size}, {size}), as M"
        raise ArgumentError(f"{name} must be {wanted}, but has the shape {array.shape}\n  help: give all matrices for the same coordinates")
    if not np.isfinite(array).all():
        raise ArgumentError(f"{name} has an entry that is not finite\n  help: check how it was computed")
    return array


def _reduced(matrices: dict[str, np.ndarray], per_node: int) -> dict[str, np.ndarray]:
    """Rows and columns of lateral motion, which must not be coupled to the others."""
    n = matrices["M"].shape[0]
    if n % per_node:
        raise ArgumentError(f"M has {n} rows, which is not a multiple of {per_node}\n  help: give `per_node=4` or `per_node=6`")
    kept = np.array([per_node * node + k for node in range(n // per_node) for k in _LATERAL[per_node]])
    others = np.setdiff1d(np.arange(n), kept)
    for name, own in matrices.items():
        size = np.abs(own).max(initial=0.0)
        coupled = max(np.abs(own[np.ix_(kept, others)]).max(initial=0.0), np.abs(own[np.ix_(others, kept)]).max(initial=0.0))
        if coupled > 1e-12 * size:
            raise ArgumentError(
                f"{name} couples lateral motion to axial or torsional motion ({coupled:.3g} of {size:.3g})\n"
                "  help: such rotors are not supported; give matrices of the lateral motion alone"
            )
    return {name: own[np.ix_(kept, kept)] for name, own in matrices.items()}


def _from_rotor(own: Any) -> tuple[dict[str, np.ndarray], Sequence[float]]:
    """Matrices and node positions of an object with `M`, `C`, `K`, `G` as methods, as ROSS has them."""
    missing = [name for name in ("M", "C", "K", "G") if not callable(getattr(own, name, None))]
    if missing:
        raise ArgumentError(
            f"the rotor has no method {' and no method '.join(missing)}\n"
            "  help: give a rotor with M(), C(w), K(w) and G(), or matrices: foldline.rotor(M=M, C=C, K=K, G=G)"
        )

    def at(name: str, frequency: float) -> np.ndarray:
        method = getattr(own, name)
        try:
            needs = any(p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD for p in inspect.signature(method).parameters.values())
        except (TypeError, ValueError):
            needs = True
        return np.asarray(method(frequency) if needs else method(), dtype=float)

    matrices = {name: at(name, 0.0) for name in ("M", "C", "K", "G")}
    for name in ("C", "K"):
        other = at(name, 1000.0)
        if not np.allclose(other, matrices[name], rtol=1e-9, atol=1e-9 * np.abs(other).max(initial=0.0)):
            raise ArgumentError(
                f"the matrix {name} of the rotor depends on the speed\n"
                "  help: describe its bearings by `[[bearing]]` with a `table` in a model file"
            )
    positions = getattr(own, "nodes_pos", None)
    return matrices, list(positions) if positions is not None else []


def _sections(name: str, parts: Sequence[Mapping[str, Any]]) -> str:
    lines = []
    for part in parts:
        if not isinstance(part, Mapping):
            raise ArgumentError(
                f'{name} must be dictionaries, but got {part!r}\n  help: {name}=[dict(node=6, clearance="0.3 mm", stiffness=5e6)]'
            )
        lines.append(f"\n[[{name}]]")
        lines += [f"{key.replace('_', '-')} = {value(own)}" for key, own in part.items()]
    return "\n".join(lines) + "\n" if lines else ""


def rotor(
    own: Any = None,
    /,
    *,
    M: Any = None,
    C: Any = None,
    K: Any = None,
    G: Any = None,
    nodes: Sequence[float] | None = None,
    per_node: int = 4,
    speed: Any = "100 rad/s",
    parameters: Mapping[str, Any] | None = None,
    unbalance: Mapping[Any, Any] | None = None,
    contacts: Sequence[Mapping[str, Any]] = (),
    forces: Sequence[Mapping[str, Any]] = (),
    bearings: Sequence[Mapping[str, Any]] = (),
    frame: str | None = None,
    gravity: Any = None,
    name: str = "rotor",
) -> Model:
    """Makes a model of a rotor given by its matrices, M q'' + (C + Omega G) q' + K q = F, with unbalance, rings and other forces.

    Parameters
    ----------
    own : object
        A rotor with methods `M`, `C`, `K` and `G` and six degrees of freedom per node, x, y, z and the rotations about them, such as
        one of ROSS. Nothing of its program is imported. Axial and torsional motion are left out.
    M, C, K, G : array of shape (n, n)
        Matrices instead. `C` and `G` are zero by default.
    nodes : sequence of float
        Positions of the nodes in m; by default their numbers.
    per_node : int
        Degrees of freedom per node in the matrices: 4 (x, y and the rotations about x and y) or 6.
    speed : number or str
        Value of the parameter `Omega`, in rad/s or with a unit: ``"3000 rpm"``.
    parameters : mapping
        Further parameters with values: ``{"c": "0.3 mm"}``.
    unbalance : mapping
        Nodes with mass times eccentricity in kg m, or with its pair of amount and phase: ``{6: 5e-3}``.
    contacts, forces, bearings : sequence of mappings
        Sections `[[contact]]`, `[[force]]` and `[[bearing]]` of a model file: ``[dict(node=6, clearance="c", stiffness=5e6)]``.
    frame, gravity : str
        As in the section `[rotor]` of a model file.
    name : str
        Name of the model.

    Returns
    -------
    Model
        Its `text` is a model file that contains the matrices.

    Raises
    ------
    ArgumentError
        If the matrices have no common shape, or couple lateral to axial or torsional motion, or change with the speed.
    InputError
        With every mistake in the sections.

    Examples
    --------
    >>> import foldline
    >>> import numpy as np
    >>> disc = foldline.rotor(
    ...     M=np.diag([2.0, 2.0, 0.01, 0.01]), K=np.diag([8e4, 8e4, 1e3, 1e3]), C=np.diag([20.0, 20.0, 0.1, 0.1]),
    ...     unbalance={0: 1e-3}, contacts=[dict(node=0, clearance="1 mm", stiffness=1e6)],
    ... )
    >>> list(disc.states)[:4]
    ['u_0', "u_0'", 'v_0', "v_0'"]
    """
    if (own is None) == (M is None):
        raise ArgumentError(
            "a rotor needs another program's rotor, or matrices\n  help: foldline.rotor(ross_rotor), or foldline.rotor(M=M, K=K)"
        )
    if own is not None:
        matrices, found = _from_rotor(own)
        nodes = found if nodes is None else nodes
        per_node = 6
    else:
        if K is None:
            raise ArgumentError("the stiffness matrix K is missing\n  help: foldline.rotor(M=M, K=K)")
        mass = _matrix("M", M)
        given = {"C": C, "K": K, "G": G}
        matrices = {"M": mass}
        matrices |= {key: np.zeros_like(mass) if each is None else _matrix(key, each, len(mass)) for key, each in given.items()}
    if per_node not in _LATERAL:
        raise ArgumentError(f"per_node must be 4 or 6, but got {per_node!r}\n  help: give lateral matrices, or all six degrees of freedom")
    if per_node == 6:
        matrices = _reduced(matrices, per_node)
    lines = [f"name = {value(name)}", "", "[parameters]", f'Omega = {{ value = {value(speed)}, unit = "rad/s" }}']
    lines += [f"{key} = {value(each)}" for key, each in (parameters or {}).items()]
    lines += ["", "[rotor]", 'speed = "Omega"']
    lines += [f"{key} = {value(each)}" for key, each in (("frame", frame), ("gravity", gravity)) if each is not None]
    rows = {key: "[" + ", ".join("[" + ", ".join(repr(float(x)) for x in row) + "]" for row in own) + "]" for key, own in matrices.items()}
    lines += ["", "[rotor.matrices]"] + [f"{key} = {text}" for key, text in rows.items()]
    if nodes is not None and len(nodes):
        lines.append("positions = [" + ", ".join(repr(float(z)) for z in nodes) + "]")
    loads = []
    for node, amount in (unbalance or {}).items():
        pair = amount if isinstance(amount, (tuple, list)) else (amount,)
        loads.append({"node": node, "amount": pair[0]} | ({"phase": pair[1]} if len(pair) > 1 else {}))
    sections = [("unbalance", loads), ("bearing", bearings), ("contact", contacts), ("force", forces)]
    return model("\n".join(lines) + "\n" + "".join(_sections(key, each) for key, each in sections))
