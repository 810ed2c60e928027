"""``space_time.html``: what is packed in it, names as text, and the page in a browser, offline."""

from __future__ import annotations

import base64
import gzip
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from mapped_network import states_with_a_queue, two_way_road

from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.page import UNIT, write_page
from uxsim_geo.export.space_time.places import LONGEST
from uxsim_geo.export.space_time.scene import space_time_scene
from uxsim_geo.network.network import Network

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
NASTY = "Köln's \"Ring\" 🚗 </script><b onload=alert(1)>'; DROP TABLE links;-- {{texts}} \\u003c"

#: waits until the page is drawn, does something, and leaves what it found in the title
DRIVER = """<script>
const waiting = setInterval(() => {
  if (!document.documentElement.dataset.ready) return;
  clearInterval(waiting);
  const found = () => { %s };
  document.title = "found " + JSON.stringify(found());
}, 20);
</script>"""


def page_of(tmp_path: Path, name: str = "Road", title: str = "A queue") -> Path:
    network = two_way_road()
    network = Network(network.nodes, network.links.assign(name=name))
    look = Look(title=title)
    scene = space_time_scene(network, states_with_a_queue(network), look)
    path = tmp_path / "space_time.html"
    write_page(path, scene, look)
    return path


def texts_of(page: str) -> dict:
    found = re.search(r'<script type="application/json" id="texts">(.*?)</script>', page, re.S)
    assert found is not None
    return json.loads(found[1])


def test_the_page_holds_the_scene_to_a_16000th_of_the_map(tmp_path: Path) -> None:
    network = two_way_road()
    scene = space_time_scene(network, states_with_a_queue(network), Look())
    page = page_of(tmp_path).read_text(encoding="utf-8")
    texts = texts_of(page)
    packed = re.search(r'id="arrays">(.*?)</script>', page, re.S)
    assert packed is not None
    data = gzip.decompress(base64.b64decode(packed[1]))

    def array(name: str) -> np.ndarray:
        place = texts["arrays"][name]
        return np.frombuffer(data, place["type"], place["count"], place["at"])

    points = array("ribbons.points").reshape(-1, 3) / texts["unit"]
    assert np.abs(points - scene["ribbons.points"]).max() <= 0.5 / UNIT + 1e-12
    assert array("ribbons.faces").reshape(-1, 4).tolist() == scene["ribbons.faces"].tolist()
    # two ribbons, then two queues of one link; its speed and queue in both bins
    assert array("walls.link").tolist() == [0, 0, 0, 0]
    assert array("walls.first").tolist() == [0, 1, 0, 1]
    assert array("walls.last").tolist() == [0, 1, 0, 1]
    assert array("links.speed").tolist() == [round(3.6 * 1975 / 190), 0]
    assert array("links.queue").tolist() == [50, 50]
    assert texts["clock"] == ["0:00:00", "0:01:40", "0:03:20"]


def test_the_page_is_whole_and_the_same_each_time(tmp_path: Path) -> None:
    path = page_of(tmp_path)
    first = path.read_bytes()
    assert page_of(tmp_path).read_bytes() == first
    page = first.decode()
    assert not re.search(r"https?://|<link [^>]*href=\"(?!data:,)|<script[^>]* src", page)
    assert len(first) < 100_000
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_names_stay_text(tmp_path: Path) -> None:
    page = page_of(tmp_path, NASTY, NASTY).read_text(encoding="utf-8")
    assert page.count("</script>") == 3
    assert "<b onload" not in page
    texts = texts_of(page)
    assert texts["names"] == [f"{NASTY}, link link 0"]
    assert texts["notes"][1].startswith(f"1  {NASTY[: LONGEST - 1]}…: ")


def driven(path: Path, script: str) -> tuple[object, str]:
    """What a script finds in the page, and what the browser's console says."""
    page = path.read_text(encoding="utf-8")
    end = page.rindex("</body>")
    path.write_text(page[:end] + DRIVER % script + page[end:], encoding="utf-8")
    command = [
        *(BROWSER, "--headless=new", "--no-sandbox", "--disable-dev-shm-usage"),
        *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
        "--host-resolver-rules=MAP * ~NOTFOUND",
        f"--user-data-dir={path.parent / 'profile'}",
        *("--enable-logging=stderr", "--virtual-time-budget=20000", "--window-size=1200,800"),
        *("--dump-dom", path.as_uri()),
    ]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    title = re.search(r"<title>found (.*?)</title>", shown.stdout, re.S)
    assert title is not None, shown.stdout[:500]
    text = title[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
    said = re.findall(r".*CONSOLE.*", shown.stderr)
    # what software rendering remarks when a pixel is read, as a hint does
    return json.loads(text), "\n".join(line for line in said if "due to ReadPixels" not in line)


needs_browser = pytest.mark.skipif(not BROWSER, reason="needs Chromium (apt-get install chromium)")

LOOK = """
  const pixel = (x, y) => { const gl = scene.gl, p = new Uint8Array(4);
    gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, p); return [...p]; };
  const count = () => { scene.draw(); const gl = scene.gl, w = scene.canvas.width;
    const h = scene.canvas.height, p = new Uint8Array(4 * w * h);
    gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, p);
    let n = 0; for (let k = 0; k < p.length; k += 4)
      if (p[k] > 90 && p[k] < 150 && p[k + 1] < 25 && p[k + 2] < 50) n++; return n; };
  const drag = byId("time");
  const at = (value) => { drag.value = value; drag.dispatchEvent(new Event("input")); };
"""


@needs_browser
def test_the_page_draws_offline_and_its_slider_keys_and_hints_work(tmp_path: Path) -> None:
    script = (
        LOOK
        + """
  const whole = count(); at(250); const early = count(), clock = byId("clock").textContent;
  at(1000); const before = scene.azimuth;
  scene.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
  const turned = scene.azimuth - before, near = scene.distance;
  scene.canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "+" }));
  const zoomed = scene.distance < near;
  document.querySelector("#cameras button").click();
  let hint = "";
  const { clientWidth: w, clientHeight: h } = scene.canvas;
  for (let y = 0; y < h && !hint; y += 7) for (let x = w - 1; x > 0 && !hint; x -= 7) {
    const wall = scene.wallAt(x, y); if (wall) hint = scene.describe(wall); }
  scene.draw();
  const listed = document.querySelectorAll("#notes li").length;
  document.querySelector("#notes button").click();
  return { ready: document.documentElement.dataset.ready, whole, early, clock, turned, zoomed,
    hint, listed, focus: scene.focus, labels: byId("labels").textContent };"""
    )
    found, console = driven(page_of(tmp_path), script)
    assert isinstance(found, dict)
    assert console == ""
    assert found["ready"] == "true"
    # they stand in the second half of the time alone
    assert found["whole"] > 100
    assert found["early"] == 0
    assert found["clock"] == "0:00:50"
    assert found["turned"] != 0
    assert found["zoomed"]
    assert "Road" in found["hint"]
    assert "km/h" in found["hint"]
    assert found["listed"] == 1
    assert found["focus"][:2] == pytest.approx([0, 0], abs=1e-4)
    assert "time, h:min" in found["labels"]


@needs_browser
def test_names_are_text_in_the_browser_too(tmp_path: Path) -> None:
    script = """return { note: document.querySelector("#notes button").textContent,
      heading: document.querySelector("h1").textContent,
      bold: document.querySelectorAll("b").length };"""
    found, console = driven(page_of(tmp_path, NASTY, NASTY), script)
    assert isinstance(found, dict)
    assert console == ""
    assert found["heading"] == f"{NASTY}: slow links in space and time"
    assert found["note"].startswith(f"{NASTY[: LONGEST - 1]}…: ")
    assert found["bold"] == 0
