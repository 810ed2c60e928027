"use strict";
// What pages about a map have in common: background, print, pointing, search, and how they open.

const MOST_SUGGESTIONS = 5000;

function byId(id) {
  return document.getElementById(id);
}

function trouble(text) {
  byId("trouble").textContent = text;
  byId("trouble").hidden = false;
}

/** Others say what is shown: showMap, drawLegend, draw, choose, find. */
class MapPage {
  /** Tiles below the map, and the map in print, once there is a map. */
  addTilesAndPrint() {
    byId("tiles").addEventListener("change", (event) => {
      this.map.showTiles(event.target.checked);
      byId("tiles-attribution").hidden = !event.target.checked;
      byId("trouble").hidden = true;
    });
    byId("tiles").closest("label").hidden = !this.run.content.map.on_earth;
    window.addEventListener("beforeprint", () => this.printMap());
    window.addEventListener("afterprint", () => {
      delete document.documentElement.dataset.paper;
      this.map.takeGround(window.matchMedia("(prefers-color-scheme: dark)").matches);
      this.draw();
    });
  }

  /** A picture on white in place of the map, which browsers do not print. */
  printMap() {
    document.documentElement.dataset.paper = "white";
    this.map.takeGround(false);
    this.drawLegend();
    this.showMap();
    byId("map-print").src = this.map.picture();
  }

  pointAt(link, point) {
    this.hovered = link === null ? null : { link, point };
    this.hover.show(link, point, this.bin);
    this.map.map.getCanvas().style.cursor = link === null ? "" : "pointer";
  }

  addSearch() {
    const { names, named } = this.run.links;
    const unnamed = new Set(this.run.links.ids.map((id) => `link ${id}`));
    const streets = named ? names.filter((name) => !unnamed.has(name)) : names;
    const options = [...streets].sort((a, b) => a.localeCompare(b)).slice(0, MOST_SUGGESTIONS);
    byId("streets").append(...options.map((name) => element("option", { value: name })));
    byId("search").addEventListener("change", (event) => {
      const wanted = event.target.value.trim().toLowerCase();
      if (wanted) byId("found").textContent = this.find(wanted);
    });
  }

  showFound(links, words) {
    this.choose(links[0], links);
    this.map?.goTo(links);
    return words;
  }
}

/** Make a page, then its map; complete says what can be read where no map can be drawn. */
async function openPage(make, complete) {
  if (typeof DecompressionStream === "undefined") {
    trouble("This browser is too old to unpack the page's data: take one from 2023 or later.");
    return;
  }
  const page = await make();
  try {
    await page.addMap();
  } catch (error) {
    page.map = undefined;
    trouble(`The map cannot be drawn here (it needs WebGL): ${error.message}. ${complete}`);
  }
  await page.draw();
  document.documentElement.dataset.ready = "true";
}
