"""The explorer in notebooks and in the browser: its state, its messages, and the page in a browser."""

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import webbrowser

import numpy as np
import pytest

import foldline


@pytest.fixture(scope="module")
def cycles(steady):
    return steady.switch(steady.special[0])


def part(page, name):
    """Returns the contents of a data element of a page."""
    return re.search(rf'<script type="[^"]+" id="data-{name}">(.*?)</script>', page, re.DOTALL)[1]


def frame(data):
    """Reads the header and the numbers of a frame."""
    length = int.from_bytes(data[:4], "little")
    header = json.loads(data[8 : 8 + length])
    return header, np.frombuffer(data[8 + length :], "<f4" if header.get("single") else "<f8")


def test_the_state_of_the_widget_is_json_and_has_every_point(cycles):
    widget = foldline.view(cycles.diagram, browser=False)
    # Modules and style sheets are texts as well.
    state = json.loads(json.dumps(widget.get_state()))
    about = json.loads(part(state["page"], "run"))
    header, numbers = frame(base64.b64decode(part(state["page"], "points-0")))
    names = [own["name"] for own in about["quantities"]]
    columns = numbers.reshape(-1, header["rows"])
    assert header["rows"] == sum(len(branch) for branch in cycles.diagram)
    for name in ("B", "x_max", "x_mean", "x_rms"):
        stored = np.concatenate([branch[name] for branch in cycles.diagram])
        # Branches may be stored in another order than that of the study.
        assert sorted(columns[3 + names.index(name)]) == sorted(stored)
    assert state["height"] == 640


def test_a_view_names_its_axes_and_a_branch_is_selected(cycles):
    widget = foldline.view(cycles, "B", "x_h2_dB", browser=False)
    assert json.loads(part(widget.page, "view")) == f"#x=B&y=x_h2_dB&branch={cycles.name.replace(' ', '+').replace('/', '%2F')}&position=0"
    about = json.loads(part(widget.page, "run"))
    names = [own["name"] for own in about["quantities"]]
    column = 3 + names.index("x_h2_dB")
    header, numbers = frame(base64.b64decode(part(widget.page, "points-0")))
    found = numbers.reshape(-1, header["rows"])[column]
    assert np.isin(cycles["x_h2_dB"], found).all()
    # Those of special points are not among the stored numbers either.
    state = json.loads(part(widget.page, "state"))["state"]
    hopf = [own for own in state["special"] if own["kind"] == "hopf"]
    assert len(hopf) == 1 and len(hopf[0]["values"]) == len(names)
    assert "v_h2" not in names and "x_h1" not in names


def test_the_kernel_answers_with_the_orbit_of_a_point(cycles):
    widget = foldline.view(cycles.diagram, browser=False)
    sent = []
    widget.send = lambda content, buffers=None: sent.append((content, buffers))
    about = json.loads(part(widget.page, "state"))["state"]["branches"]
    number = next(own["id"] for own in about if own["name"] == cycles.name)
    position = int(cycles.position[-1])
    widget._handle_custom_msg({"id": "a-1", "branch": number, "position": position, "special": -1}, [])
    widget._handle_custom_msg({"id": "a-2", "branch": number, "position": 10**6, "special": -1}, [])
    widget._handle_custom_msg({"id": "a-3", "branch": "drop", "position": None, "special": -1}, [])
    assert [content["id"] for content, _ in sent] == ["a-1", "a-2", "a-3"]
    assert [len(buffers) for _, buffers in sent] == [1, 0, 0]
    header, numbers = frame(sent[0][1][0])
    assert (header["position"], header["period"]) == (position, cycles[-1].period)
    orbit = numbers[header["rows"] : 2 * header["rows"]]
    low, high = cycles[-1].ranges["x"]
    # The picture has a finite number of places, and single precision.
    assert abs(orbit.min() - low) < 1e-3 * (high - low) and abs(orbit.max() - high) < 1e-3 * (high - low)


def test_outside_notebooks_the_page_is_opened_in_the_browser(cycles, monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or True)
    path = foldline.view(cycles.diagram, y="x")
    assert opened == [f"file://{path}"] or opened[0].startswith("file:///")
    with open(path, encoding="utf-8") as file:
        page = file.read()
    assert json.loads(part(page, "view")) == "#y=x_max"
    assert not re.search(r'(src|href)="(?!data:)', page), "the page loads something"
    os.remove(path)
    monkeypatch.setattr(webbrowser, "open", lambda address: False)
    with pytest.warns(UserWarning, match="there is no browser here") as heard:
        os.remove(foldline.view(cycles.diagram))
    assert heard[0].filename == __file__


def test_a_run_in_a_folder_is_shown_without_loading_it(cycles, tmp_path):
    cycles.diagram.save(tmp_path / "run")
    assert foldline.view(tmp_path / "run", browser=False).page == foldline.view(foldline.open(tmp_path / "run"), browser=False).page
    with pytest.raises(foldline.RunFileError, match="there is no run file"):
        foldline.view(tmp_path / "nowhere", browser=False)


def test_without_anywidget_the_message_names_it(cycles, monkeypatch):
    from foldline import _view

    _view._widget_class.cache_clear()
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(ImportError, match=r'pip install "foldline\[view\]"'):
        foldline.view(cycles.diagram, browser=False)
    _view._widget_class.cache_clear()


def test_unknown_quantities_are_refused_with_those_that_exist(cycles):
    with pytest.raises(foldline.InputError, match="one of: A, B, x, y, period"):
        foldline.view(cycles.diagram, y="w", browser=False)


#: A notebook for one widget: its module, a kernel whose answers were written beforehand, and a click.
NOTEBOOK = """<!DOCTYPE html><body data-jp-theme-light="false"><div id="cell"></div><script type="module">
const { esm, state, answers, place } = JSON.parse(document.getElementById("data").textContent);
const bytes = (text) => Uint8Array.from(atob(text), (own) => own.charCodeAt(0));
const { default: widget } = await import(`data:text/javascript;base64,${esm}`);
const heard = [];
const asked = [];
const model = {
  get: (name) => state[name],
  on: (name, call) => heard.push(call),
  off: () => {},
  send: (message) => {
    asked.push([message.branch, message.position, message.special]);
    const found = answers[`${message.branch}:${message.position}`];
    // The bytes of a message do not begin at a multiple of eight.
    const all = new Uint8Array([1, 2, 3, ...bytes(found)]);
    heard.forEach((call) => call({ id: message.id }, [new DataView(all.buffer, 3)]));
  },
};
widget.render({ model, el: document.getElementById("cell") });
const until = async (holds) => { while (!holds()) await new Promise((done) => setTimeout(done, 10)); };
const inside = () => document.querySelector("iframe").contentWindow?.foldline?.app;
await until(() => inside()?.ready && inside().diagram.chart.drawn);
const app = inside();
const { canvas } = app.diagram.chart;
const [x, y] = app.diagram.pixel(place);
const corner = canvas.getBoundingClientRect();
const at = { clientX: corner.left + x, clientY: corner.top + y, pointerId: 1, button: 0, bubbles: true };
canvas.setPointerCapture = () => {};
const Pointer = canvas.ownerDocument.defaultView.PointerEvent;
for (const name of ["pointermove", "pointerdown", "pointerup"]) canvas.dispatchEvent(new Pointer(name, at));
const tip = canvas.parentElement.querySelector(".tip").textContent;
await until(() => app.orbit.solution?.header.position === place.position);
const out = document.createElement("pre");
out.id = "found";
out.textContent = JSON.stringify({
  tip, asked, selected: app.selected, rows: app.orbit.solution.rows, period: app.orbit.solution.header.period,
  dark: canvas.ownerDocument.documentElement.dataset.theme, progress: canvas.ownerDocument.getElementById("progress").textContent,
});
document.body.replaceChildren(out);
</script><script type="application/json" id="data">DATA</script></body>"""


def browser():
    """Program of Chromium, as `cargo xtask page` finds it."""
    known = ["/usr/lib/chromium/chromium", "/usr/lib64/chromium-browser/chromium-browser", "/opt/google/chrome/chrome"]
    return next((own for own in [os.environ.get("CHROMIUM"), *known] if own and os.path.isfile(own)), shutil.which("chromium"))


@pytest.mark.skipif(browser() is None, reason="there is no Chromium; CHROMIUM=PATH names one")
def test_the_widget_draws_the_diagram_and_a_click_opens_the_orbit_from_the_kernel(cycles, tmp_path):
    widget = foldline.view(cycles.diagram, browser=False)
    state = {name: widget.get_state()[name] for name in ("page", "height")}
    number = next(own["id"] for own in json.loads(part(widget.page, "state"))["state"]["branches"] if own["name"] == cycles.name)
    # A point whose orbit the page does not contain, far from special points.
    stored = {int(own) for own in re.findall(rf'id="data-solution-{number}-(-?\d+)"', widget.page)}
    for position in stored:
        state["page"] = re.sub(rf'<script type="text/plain" id="data-solution-{number}-{position}">.*?</script>\n', "", state["page"])
    position = int(cycles.position[len(cycles) // 2])
    answer = base64.b64encode(widget._run.solution(number, position, -1)).decode()
    data = {
        "esm": base64.b64encode(widget._esm.encode()).decode(),
        "state": state,
        "answers": {f"{number}:{position}": answer},
        "place": {"branch": number, "position": position, "special": -1},
    }
    notebook = tmp_path / "notebook.html"
    notebook.write_text(NOTEBOOK.replace("DATA", json.dumps(data).replace("<", "\\u003c")), encoding="utf-8")
    # Every name is resolved to nothing: the page may not ask for anything.
    options = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--window-size=1000,800",
        "--host-resolver-rules=MAP * ~NOTFOUND",
        f"--user-data-dir={tmp_path}",
    ]
    command = [browser(), *options, "--virtual-time-budget=60000", "--dump-dom", notebook.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=True)
    assert '<pre id="found">' in done.stdout, done.stdout[-2000:] + done.stderr[-2000:]
    found = json.loads(re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)[1])
    assert found["asked"] == [[number, position, -1]]
    assert found["selected"] == data["place"]
    point = cycles[len(cycles) // 2]
    assert found["period"] == point.period and found["rows"] > 100
    assert f"{point['B']:.9g}"[:8] in found["tip"]
    assert found["dark"] == "dark"
    assert found["progress"].startswith(f"notebook · {sum(len(branch) for branch in cycles.diagram)} points")
