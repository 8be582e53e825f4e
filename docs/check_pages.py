"""Open built pages in headless Chromium and tell what is wrong: ``check_pages.py FOLDER``.

Every page is opened wide and as wide as a phone. Pictures must load and be small, nothing may be
told in the console, no page may be wider than the screen, links within the pages must lead
somewhere, the search must find a class of the reference and a word of the guide, labels of
drawings, SVG files of matplotlib, must not cover each other, and scenes must be small and show
something.
Needs selenium and Debian's packages ``chromium`` and ``chromium-driver``. With ``--shots DIR``
pictures of the pages are kept, with ``--dark`` they are those of a reader who likes dark pages.
"""

import argparse
import functools
import io
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote, urldefrag, urljoin, urlparse

#: bytes of a picture and of a scene
LARGEST, SCENE = 300_000, 2_000_000
#: width and height of the screens in CSS pixels, and whether they are those of a phone
SCREENS = {"wide": (1280, 900, False), "phone": (390, 844, True)}
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",  # WebGL without a graphics card
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)
BROKEN = """return Array.from(document.images)
    .filter(i => i.loading != 'lazy' && !(i.complete && i.naturalWidth > 0)).map(i => i.src)"""
WIDTH = "return [document.documentElement.scrollWidth, window.innerWidth]"
EAGER = "document.querySelectorAll('img').forEach(i => i.loading = 'eager')"
LOADED = """const done = arguments[0];
    Promise.all(Array.from(document.images).map(i => i.decode().catch(() => 0))).then(done)"""

#: pairs of texts of a drawing that cover a tenth of each other
COVERED = """const boxes = Array.from(document.querySelectorAll('g[id^="text_"]'))
    .map(g => [g.id, g.getBoundingClientRect()]).filter(([id, b]) => b.width * b.height > 0);
  const found = [];
  boxes.forEach(([one, a], i) => boxes.slice(i + 1).forEach(([other, b]) => {
    const w = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const h = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    const least = Math.min(a.width * a.height, b.width * b.height);
    if (w > 0 && h > 0 && w * h > 0.1 * least) found.push(one + ' and ' + other);
  }));
  return found"""


#: words to search for and pages that have them, and the wait until results are there
WORDS = {"RigidPunch": "api/punch.html", "tilt": "words.html"}
RESULTS = """const done = arguments[0], end = Date.now() + 10000, look = () => {
    const links = Array.from(document.querySelectorAll('.search a')).map(a => a.href);
    links.length || Date.now() > end ? done(links) : setTimeout(look, 100)}; look()"""


class Page(HTMLParser):
    """Links of a page and the places in it that others may link to."""

    def __init__(self, text: str):
        super().__init__()
        self.links: set[str] = set()
        self.places: set[str] = {""}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list) -> None:
        """Collect links and places."""
        for name, value in attrs:
            if name == "id" or (tag == "a" and name == "name"):
                self.places.add(value)
            elif name in ("href", "src") and value:
                self.links.add(value)


def broken_links(folder: Path) -> list[str]:
    """Links from page to page, or to files, that lead nowhere."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in folder.rglob("*.html")}
    faults = []
    for path, page in sorted(pages.items()):
        for link in sorted(page.links):
            if urlparse(link).scheme or link.startswith("//"):
                continue
            target, place = urldefrag(urljoin(path.as_uri(), link))
            file = Path(unquote(urlparse(target).path))
            name = path.relative_to(folder)
            if not file.is_file():
                faults.append(f"{name}: no file for the link {link}")
            elif file in pages and unquote(place) not in pages[file].places:
                faults.append(f"{name}: no place for the link {link}")
    return faults


class Quiet(SimpleHTTPRequestHandler):
    """Serves files and says nothing."""

    def log_message(self, *args) -> None:
        """Say nothing."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of a server of the folder on this machine."""
    handler = functools.partial(Quiet, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@contextmanager
def browser():
    """Headless Chromium with a profile of its own.

    Raises
    ------
    FileNotFoundError
        If Chromium or its driver is missing.
    """
    from selenium import webdriver

    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and driver):
        raise FileNotFoundError("no Chromium. Remedy: apt install chromium chromium-driver")
    # selenium would fetch what it is not told
    service = webdriver.ChromeService(driver)
    with tempfile.TemporaryDirectory() as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = chromium
        for flag in (*FLAGS, f"--user-data-dir={profile}"):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        opened = webdriver.Chrome(options=options, service=service)
        try:
            yield opened
        finally:
            opened.quit()


def check(folder: Path, shots: Path | None = None, dark: bool = False) -> list[str]:
    """What is wrong with the pages in a folder, one line each."""
    folder = Path(folder).resolve()
    pages = set(folder.rglob("*.html")) - set(folder.glob("scenes/*"))
    names = sorted(path.relative_to(folder).as_posix() for path in pages)
    if "index.html" not in names:
        raise FileNotFoundError(f"expected built pages in {folder}, found no index.html")
    faults = broken_links(folder)
    for files, most in (("_images/*", LARGEST), ("scenes/*", SCENE)):
        for file in sorted(folder.glob(files)):
            if (size := file.stat().st_size) > most:
                faults.append(f"{file.name}: {size} bytes, more than {most}")
    with served(folder) as address, browser() as driver:
        theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [theme]})
        for screen, (width, height, phone) in SCREENS.items():
            size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone}
            driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            for name in names:
                where = f"{name}, {screen}"
                driver.get(f"{address}/{name}")
                driver.execute_script(EAGER)
                driver.execute_async_script(LOADED)
                faults += [f"{where}: broken picture {x}" for x in driver.execute_script(BROKEN)]
                found, room = driver.execute_script(WIDTH)
                if found > room or room != width:
                    faults.append(f"{where}: {found} pixels wide on a screen of {room}")
                told = driver.get_log("browser")
                faults += [f"{where}: {line['level']} {line['message']}" for line in told]
                if shots is not None:
                    keep(driver, shots / screen / Path(name).with_suffix(".png"), size)
        for word, place in WORDS.items():
            driver.get(f"{address}/search.html?q={word}")
            if not any(place in link for link in driver.execute_async_script(RESULTS)):
                faults.append(f"search.html: {word} is not found in {place}")
        for scene in sorted(folder.glob("scenes/*.html")):
            driver.get(f"{address}/scenes/{scene.name}")
            if not is_drawn(driver):
                faults.append(f"{scene.name}: nothing is seen")
            told = [line for line in driver.get_log("browser") if line["level"] == "SEVERE"]
            faults += [f"{scene.name}: {line['message']}" for line in told]
        for drawing in sorted(folder.glob("_images/*.svg")):
            driver.get(f"{address}/_images/{drawing.name}")
            covered = driver.execute_script(COVERED)
            faults += [f"{drawing.name}: {pair} cover each other" for pair in covered]
    return faults


def is_drawn(driver) -> bool:
    """Whether a scene has more than one colour, after ten seconds at the latest."""
    from PIL import Image

    for _ in range(100):
        image = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB")
        if any(low < high for low, high in image.getextrema()):
            return True
        time.sleep(0.1)
    return False


def keep(driver, path: Path, size: dict) -> None:
    """A picture of the whole page."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tall = driver.execute_script("return document.documentElement.scrollHeight")
    override = functools.partial(driver.execute_cdp_cmd, "Emulation.setDeviceMetricsOverride")
    override(size | {"height": min(tall, 12_000)})
    driver.save_screenshot(str(path))
    override(size)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where sphinx wrote the pages")
    parser.add_argument("--shots", type=Path, metavar="DIR", help="keep pictures of pages there")
    parser.add_argument("--dark", action="store_true", help="the pages' dark theme")
    options = parser.parse_args()
    faults = check(options.folder, options.shots, options.dark)
    print("\n".join(faults) or "nothing wrong")
    sys.exit(bool(faults))
