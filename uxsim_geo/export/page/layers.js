"use strict";
// The layers of the map: grey roads, and beside each the traffic of its direction, by MapLibre GL JS.

const FEW_LINKS = 400;  // links long enough on the map to be seen without circles
const MANY_LINKS = 2000;
const CIRCLE_OPACITY = 0.45;
const PALETTE = 10;  // numbers kept for the classes of a palette

/** Builds the map: layers from the ground up, and marks on it. RoadMap moves what is here in time. */
class MapLayers {
  /** calls: {hover(link, point), choose(link), zone(number), worst(number), redraw(), trouble(text)} */
  constructor(run, container, calls) {
    this.run = run;
    this.calls = calls;
    this.isDark = window.matchMedia("(prefers-color-scheme: dark)").matches;
    this.circles = run.lines.length > FEW_LINKS;
    this.class = new Int8Array(run.lines.length).fill(-1);
    this.width = new Int8Array(run.lines.length);
    this.bounds = MapLayers.boundsOf(run.lines);
    this.map = new maplibregl.Map({
      container,
      style: { version: 8, sources: {}, layers: [], transition: { duration: 0, delay: 0 } },
      bounds: this.bounds,
      fitBoundsOptions: { padding: 34 },
      attributionControl: false,
      renderWorldCopies: false,
      dragRotate: false,
      pitchWithRotate: false,
      fadeDuration: 0,
      maxZoom: 20,
    });
    this.map.touchZoomRotate.disableRotation();
    this.map.keyboard.disableRotation();
    this.map.addControl(new maplibregl.NavigationControl({ showCompass: false }), "top-left");
    if (run.content.map.on_earth) {
      this.map.addControl(new maplibregl.ScaleControl({ maxWidth: 120 }), "bottom-left");
    }
    this.ready = new Promise((resolve) => this.map.once("load", () => {
      this.addLayers();
      this.listen();
      this.map.once("idle", resolve);
    }));
  }

  static boundsOf(lines) {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (const line of lines) {
      for (const [x, y] of line) {
        box[0] = Math.min(box[0], x);
        box[1] = Math.min(box[1], y);
        box[2] = Math.max(box[2], x);
        box[3] = Math.max(box[3], y);
      }
    }
    return [[box[0], box[1]], [box[2], box[3]]];
  }

  colour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--map-${name}`).trim();
  }

  /** Widths at the zoom that shows the whole: wide where few links have much room. */
  chooseWidths() {
    const { lines } = this.run;
    const sample = Math.max(1, Math.floor(lines.length / 500));
    const lengths = [];
    for (let link = 0; link < lines.length; link += sample) {
      const [from, to] = [lines[link][0], lines[link][lines[link].length - 1]];
      const [a, b] = [this.map.project(from), this.map.project(to)];
      lengths.push(Math.hypot(a.x - b.x, a.y - b.y));
    }
    const usual = lengths.sort((a, b) => a - b)[Math.floor(lengths.length / 2)];
    this.narrow = Math.min(Math.max(usual / 60, 0.6), 1.6);
    this.wide = Math.min(Math.max(usual / 7, 3.6), 11);
    this.gap = Math.min(Math.max(usual / 100, 0.3), 1.2);
    this.zoom = this.map.getZoom();
  }

  /** An expression that grows with the zoom, from what it is when all is shown. */
  grown(value) {
    return ["interpolate", ["exponential", 1.5], ["zoom"],
      this.zoom, value, this.zoom + 6, ["*", 4.5, value]];
  }

  addLayers() {
    this.chooseWidths();
    this.addSources();
    this.map.addLayer({ id: "ground", type: "background", paint: { "background-color": this.colour("ground") } });
    const kinds = this.run.links.minor ? ["minor", "major"] : ["major"];
    for (const kind of kinds) this.addLines("roads", kind, [["==", ["get", "road"], 1]]);
    this.addJunctions();
    this.map.addLayer({ id: "chosen", type: "line", source: "chosen", layout: { "line-join": "round" },
      paint: this.paints().chosen });
    for (const kind of kinds) this.addLines("traffic", kind, []);
    this.picked = kinds.map((kind) => `traffic-${kind}`);
    this.addTripLayers();
    this.markPlaces();
  }

  /** Links as features in the order in which they are drawn; and what is empty at first. */
  addSources() {
    const { lines, links } = this.run;
    const minor = new Set(links.order.slice(0, links.minor));
    const drawn = this.roads();
    const features = links.order.map((link) => ({
      type: "Feature", id: link,
      properties: { minor: minor.has(link) ? 1 : 0, road: drawn.has(link) ? 1 : 0 },
      geometry: { type: "LineString", coordinates: lines[link] },
    }));
    const collection = (some) => ({ type: "FeatureCollection", features: some });
    this.map.addSource("links", { type: "geojson", data: collection(features), tolerance: 0.3, buffer: 64 });
    for (const name of ["chosen", "arcs", "zones"]) {
      this.map.addSource(name, { type: "geojson", data: collection([]) });
    }
  }

  /** Layer of all links that fulfil the conditions; minor ones wait until one looks closer. */
  addLines(id, kind, conditions) {
    this.map.addLayer({
      id: `${id}-${kind}`, type: "line", source: "links", paint: this.paints()[id], layout: { "line-join": "round" },
      filter: ["all", ["==", ["get", "minor"], kind === "minor" ? 1 : 0], ...conditions],
      ...(kind === "minor" ? { minzoom: this.zoom + 1.5 } : {}),
    });
  }

  /** Colours, widths and offsets to the side on which people drive. */
  paints() {
    const side = this.run.content.map.left ? -1 : 1;
    const width = ["coalesce", ["feature-state", "width"], 0];
    // the inner edge at the road's middle; where there are many links their middle stays in place,
    // which is less to compute in every step
    const fixed = side * (this.gap + this.wide / 2);
    const offset = this.run.lines.length > MANY_LINKS ? fixed : ["*", side, ["+", this.gap, ["/", width, 2]]];
    return {
      roads: { "line-color": this.colour("roads"), "line-width": this.grown(this.narrow) },
      chosen: {
        "line-color": this.colour("ink"),
        "line-width": this.grown(this.wide + 2),
        "line-offset": this.grown(fixed),
      },
      traffic: {
        "line-color": this.colours(),
        "line-width": this.grown(width),
        "line-offset": this.grown(offset),
      },
    };
  }

  /** One link of each road: the other direction is the same line. */
  roads() {
    const { lines, links } = this.run;
    const found = new Map();
    lines.forEach((line, link) => {
      const ends = [links.from[link], links.to[link]].sort((a, b) => a - b);
      const key = `${ends} ${line.length} ${Math.round(links.length[link])}`;
      if (!found.has(key)) found.set(key, link);
    });
    return new Set(found.values());
  }

  /** Circles under the traffic, at first without size. */
  addJunctions() {
    const { points, largest_min: most } = this.run.content.junctions;
    this.map.addSource("junctions", { type: "geojson", data: {
      type: "FeatureCollection",
      features: points.map((point, id) => ({
        type: "Feature", id, properties: {}, geometry: { type: "Point", coordinates: point },
      })),
    } });
    this.mostLost = most || 1;
    this.radius = new Uint8Array(points.length);
    this.map.addLayer({ id: "junctions", type: "circle", source: "junctions", paint: {
      "circle-radius": ["coalesce", ["feature-state", "radius"], 0],
      "circle-color": this.slowest(), "circle-opacity": CIRCLE_OPACITY } });
  }

  addTripLayers() {
    this.map.addLayer({ id: "arcs", type: "line", source: "arcs", layout: { "line-cap": "round" }, paint: {
      "line-color": this.colour("ink"), "line-opacity": 0.75, "line-width": ["get", "width"] } });
    this.map.addLayer({ id: "zones", type: "circle", source: "zones", paint: {
      "circle-radius": ["get", "radius"], "circle-color": this.colour("ink"), "circle-opacity": 0.35,
      "circle-stroke-color": this.colour("ground"), "circle-stroke-width": 1 } });
  }

  /** Numbers at the worst places, and names of nodes where there are few. */
  markPlaces() {
    const { lines, content, links } = this.run;
    this.marks = [];  // those on top first
    const note = (text, place, isNumber) => this.marks.push({ text, place, isNumber });
    content.worst.slice(0, 5).forEach((place, number) => {
      const line = lines[place.link];
      const mark = element("div", { class: "place-mark" }, String(number + 1));
      mark.title = this.run.name(place.link);
      mark.addEventListener("click", (event) => {
        event.stopPropagation();
        this.calls.worst(number);
      });
      mark.style.zIndex = content.worst.length - number;  // where they meet, the worse lies on top
      new maplibregl.Marker({ element: mark }).setLngLat(MapLayers.middle(line)).addTo(this.map);
      note(String(number + 1), MapLayers.middle(line), true);
    });
    if (links.nodes.length > 60) return;
    const seen = new Set();
    lines.forEach((line, link) => {
      for (const [node, place] of [[links.from[link], line[0]], [links.to[link], line[line.length - 1]]]) {
        if (seen.has(node)) continue;
        seen.add(node);
        const mark = element("div", { class: "node-mark" }, links.nodes[node]);
        new maplibregl.Marker({ element: mark }).setLngLat(place).addTo(this.map);
        note(links.nodes[node], place, false);
      }
    });
  }

  /** The place half way along a line. */
  static middle(line) {
    const lengths = line.slice(1).map(([x, y], i) => Math.hypot(x - line[i][0], y - line[i][1]));
    let rest = lengths.reduce((sum, length) => sum + length, 0) / 2;
    for (let i = 0; i < lengths.length; i++) {
      if (rest <= lengths[i] && lengths[i] > 0) {
        const share = rest / lengths[i];
        return line[i].map((value, axis) => value + share * (line[i + 1][axis] - value));
      }
      rest -= lengths[i];
    }
    return line[0];
  }

  /** All palettes at once, so that neither another quantity nor another ground lays out anew. */
  colours() {
    const cases = [];
    this.run.content.quantities.forEach((quantity, number) => {
      quantity.colours.forEach((colour, index) => cases.push(2 * PALETTE * number + index, colour));
      quantity.colours_on_dark.forEach((colour, index) => cases.push(2 * PALETTE * number + PALETTE + index, colour));
    });
    return ["match", ["coalesce", ["feature-state", "colour"], -1], ...cases, "#888888"];
  }

  /** The colour of standing traffic. */
  slowest() {
    const [speed] = this.run.content.quantities;
    return (this.isDark ? speed.colours_on_dark : speed.colours)[0];
  }
}
