"use strict";
// The map in time: colours and widths of each step, what lies under the pointer, outlines, tiles.
//
// A step in time tells the library the new colour and width of those links only that changed
// (feature state); nothing is laid out anew.

const TILES = "https://tile.openstreetmap.org/{z}/{x}/{y}.png";
const WIDTHS = 8;  // kinds of width that are told apart
const LARGEST_CIRCLE = 30;  // px

class RoadMap extends MapLayers {
  /** Circles as large as the time lost before each junction in a time step; tells how many changed. */
  showJunctions(bin) {
    const { run } = this;
    const lost = new Float64Array(this.radius.length);
    run.content.junctions.links.forEach((place, link) => {
      if (place >= 0) lost[place] += run.delay(link, bin);
    });
    let changed = 0;
    lost.forEach((minutes, id) => {
      // area is time lost; what is too small to matter has no circle
      const share = this.circles ? minutes / this.mostLost : 0;
      const radius = share < run.content.junctions.least ? 0 : Math.round(LARGEST_CIRCLE * Math.sqrt(share));
      if (radius === this.radius[id]) return;
      this.radius[id] = radius;
      changed += 1;
      this.map.setFeatureState({ source: "junctions", id }, { radius });
    });
    return changed;
  }

  /** Show a quantity in a time step; tells whether anything is to be drawn. */
  show(number, bin) {
    const { run } = this;
    let changed = this.showJunctions(bin);
    const quantity = run.content.quantities[number];
    const palette = 2 * PALETTE * number + (this.isDark ? PALETTE : 0);
    for (let link = 0; link < this.class.length; link++) {
      const value = run.value(quantity.key, link, bin);
      let index = -1, width = 0;
      if (value !== null) {
        index = 0;
        while (index < quantity.breaks.length && value >= quantity.breaks[index]) index += 1;
        index += palette;
        width = 1 + Math.round((WIDTHS - 1) * run.shareOfRoad(link, bin));
      }
      if (index === this.class[link] && width === this.width[link]) continue;
      changed += 1;
      this.class[link] = index;
      this.width[link] = width;
      const px = width ? 1 + this.narrow + ((this.wide - this.narrow - 1) * (width - 1)) / (WIDTHS - 1) : 0;
      this.map.setFeatureState({ source: "links", id: link }, { colour: index, width: px });
    }
    return changed > 0;
  }

  listen() {
    let point = null;
    this.map.on("mousemove", (event) => {
      if (point === null) requestAnimationFrame(() => {
        this.calls.hover(this.linkAt(point), point);
        point = null;
      });
      point = event.point;
    });
    this.map.on("error", ({ error, sourceId }) => this.calls.trouble(sourceId === "tiles"
      ? "The background map cannot be loaded; the rest needs no network." : `The map has a fault: ${error.message}`));
    this.map.on("mouseout", () => this.calls.hover(null, null));
    this.map.on("click", (event) => {
      const [zone] = this.map.queryRenderedFeatures(event.point, { layers: ["zones"] });
      if (zone) this.calls.zone(zone.properties.zone);
      else this.calls.choose(this.linkAt(event.point));
    });
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => {
      this.takeGround(event.matches);
      this.calls.redraw();
    });
  }

  /** Colours of everything but the traffic, which show() sets. */
  takeGround(isDark) {
    this.isDark = isDark;
    this.map.setPaintProperty("ground", "background-color", this.colour("ground"));
    for (const layer of this.map.getStyle().layers.filter(({ id }) => id.startsWith("roads"))) {
      this.map.setPaintProperty(layer.id, "line-color", this.colour("roads"));
    }
    this.map.setPaintProperty("junctions", "circle-color", this.slowest());
    for (const [layer, property] of [["chosen", "line-color"], ["arcs", "line-color"], ["zones", "circle-color"]]) {
      this.map.setPaintProperty(layer, property, this.colour("ink"));
    }
  }

  /** The link at a place on the screen, or near it; null for none. */
  linkAt(point) {
    if (!point) return null;
    for (const reach of [1, 4, 9]) {
      const box = [[point.x - reach, point.y - reach], [point.x + reach, point.y + reach]];
      const [found] = this.map.queryRenderedFeatures(box, { layers: this.picked });
      if (found) return found.id;
    }
    return null;
  }

  /** Outline some links. */
  outline(links) {
    this.map.getSource("chosen").setData({
      type: "FeatureCollection",
      features: links.map((link) => ({
        type: "Feature", properties: {}, geometry: { type: "LineString", coordinates: this.run.lines[link] },
      })),
    });
  }

  goTo(links) {
    const bounds = RoadMap.boundsOf(links.map((link) => this.run.lines[link]));
    this.map.fitBounds(bounds, { padding: 90, maxZoom: this.zoom + 4, animate: false });
  }

  /** Zones and arcs as GeoJSON; an empty list takes them away. The links step back meanwhile. */
  showTrips(zones, arcs) {
    const isShown = zones.length > 0;
    this.map.getContainer().classList.toggle("shows-trips", isShown);
    for (const layer of this.picked) this.map.setPaintProperty(layer, "line-opacity", isShown ? 0.25 : 1);
    this.map.setPaintProperty("junctions", "circle-opacity", isShown ? 0 : CIRCLE_OPACITY);
    const collection = (features) => ({ type: "FeatureCollection", features });
    this.map.getSource("zones").setData(collection(zones));
    this.map.getSource("arcs").setData(collection(arcs));
  }

  /** Tiles from the network of networks, for those who ask for them. */
  showTiles(wanted) {
    if (!wanted) {
      this.map.removeLayer("tiles");
      this.map.removeSource("tiles");
      return;
    }
    this.map.addSource("tiles", { type: "raster", tiles: [TILES], tileSize: 256, maxzoom: 19 });
    const [, above] = this.map.getStyle().layers;
    this.map.addLayer({ id: "tiles", type: "raster", source: "tiles", paint: {
      "raster-saturation": -0.8, "raster-opacity": 0.7 } }, above.id);
  }

  /** The map as it is now with its marks and scale, as the address of a picture. */
  picture() {
    this.map.redraw();
    const drawn = this.map.getCanvas();
    const canvas = element("canvas", { width: drawn.width, height: drawn.height });
    const pen = canvas.getContext("2d");
    pen.drawImage(drawn, 0, 0);
    const { clientWidth: width, clientHeight: height } = this.map.getContainer();
    pen.scale(drawn.width / width, drawn.height / height);
    // as on the screen: names of nodes below, of numbers the lower ones on top
    for (const mark of [...this.marks].reverse()) this.drawMark(pen, mark);
    this.drawScale(pen, height);
    return canvas.toDataURL("image/png");
  }

  drawMark(pen, { text, place, isNumber }) {
    const { x, y } = this.map.project(place);
    pen.font = isNumber ? "700 13px sans-serif" : "600 11px sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    if (isNumber) {
      pen.fillStyle = "#1c2126";
      pen.strokeStyle = "#ffffff";
      pen.beginPath();
      pen.arc(x, y, 11, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    } else {
      const half = pen.measureText(text).width / 2 + 4;
      pen.fillStyle = "rgb(255 255 255 / 82%)";
      pen.fillRect(x - half, y - 8, 2 * half, 16);
    }
    pen.fillStyle = isNumber ? "#ffffff" : this.colour("ink");
    pen.fillText(text, x, y + 0.5);
  }

  /** The bar that the library shows, which is no part of its picture; none on no place. */
  drawScale(pen, height) {
    const bar = this.map.getContainer().querySelector(".maplibregl-ctrl-scale");
    if (!bar) return;
    pen.strokeStyle = pen.fillStyle = this.colour("ink");
    pen.lineWidth = 2;
    pen.strokeRect(10, height - 14, parseFloat(bar.style.width), 4);
    pen.font = "11px sans-serif";
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    pen.fillText(bar.textContent, 12, height - 16);
  }
}
