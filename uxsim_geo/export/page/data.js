"use strict";
// Unpacks what the page holds, and answers what happened on a link in a time step.

/** The bytes of one of the page's packed parts (base64 of gzip). */
async function unpacked(id) {
  const element = document.getElementById(id);
  const text = element.textContent;
  const bytes = Uint8Array.fromBase64 ? Uint8Array.fromBase64(text)
    : Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  element.textContent = "";
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** Undoes differences along rows; unsigned integers wrap round by themselves. */
function summedAlongRows(codes, columns) {
  for (let i = 0; i < codes.length; i++) {
    if (i % columns) codes[i] += codes[i - 1];
  }
  return codes;
}

/** Lines of all links, each an array of [longitude, latitude]; the step is that of packing.py. */
function unpackedLines(counts, planes) {
  const degrees = 5e-6;
  const size = planes.length / 4;
  const lines = new Array(counts.length);
  let place = 0, x = 0, y = 0;
  const next = () => {
    const value = planes[place] | (planes[place + size] << 8)
      | (planes[place + 2 * size] << 16) | (planes[place + 3 * size] << 24);
    place += 1;
    return value;
  };
  for (let link = 0; link < counts.length; link++) {
    const line = new Array(counts[link]);
    for (let point = 0; point < line.length; point++) {
      x += next();
      y += next();
      line[point] = [x * degrees, y * degrees];
    }
    lines[link] = line;
  }
  return lines;
}

/** The run: links, time steps, and Edie's states of each. Units as people read them. */
class Run {
  constructor(content, arrays, lines) {
    this.content = content;
    this.links = content.links;
    this.lines = lines;
    this.edges = content.edges;
    this.bins = content.edges.length - 1;
    this.arrays = arrays;
    const { top, least, largest } = content;
    this.densityOf = new Float64Array(top + 1);
    for (let code = 1; code <= top; code++) {
      this.densityOf[code] = 1000 * least * (largest / least) ** ((code - 1) / (top - 1));
    }
  }

  static async load() {
    const content = JSON.parse(new TextDecoder().decode(await unpacked("document")));
    const bins = content.edges.length - 1;
    const Codes = content.top > 255 ? Uint16Array : Uint8Array;
    const arrays = {};
    for (const name of ["density", "speed", "queue"]) {
      arrays[name] = summedAlongRows(new Codes(await unpacked(name)), bins);
    }
    const counts = new Uint32Array(await unpacked("points"));
    const lines = unpackedLines(counts, new Uint8Array(await unpacked("places")));
    return new Run(content, arrays, lines);
  }

  /** Whether anybody was on the link in this time step. */
  isUsed(link, bin) {
    return this.arrays.density[link * this.bins + bin] > 0;
  }

  /** Vehicles per km on all lanes. */
  density(link, bin) {
    return this.densityOf[this.arrays.density[link * this.bins + bin]];
  }

  /** Speed as a share of the free speed; null where nobody was. */
  speedRatio(link, bin) {
    return this.isUsed(link, bin)
      ? this.arrays.speed[link * this.bins + bin] / this.content.top : null;
  }

  /** km/h; null where nobody was. */
  speed(link, bin) {
    return this.isUsed(link, bin) ? this.speedRatio(link, bin) * this.links.free_kmh[link] : null;
  }

  /** Vehicles per hour: density times speed, as Edie defines it. */
  volume(link, bin) {
    return this.isUsed(link, bin) ? this.density(link, bin) * this.speed(link, bin) : 0;
  }

  /** Minutes lost by all vehicles together: (1 − speed / free speed) of the time they spent. */
  delay(link, bin) {
    if (!this.isUsed(link, bin)) return 0;
    const vehicles = this.density(link, bin) * this.links.length[link] / 1000;
    const minutes = (this.edges[bin + 1] - this.edges[bin]) / 60;
    return vehicles * minutes * (1 - this.speedRatio(link, bin));
  }

  /** Metres of queue at the end of the time step. */
  queue(link, bin) {
    return this.arrays.queue[link * this.bins + bin] / this.content.top * this.links.length[link];
  }

  /** What is coloured: the number that the classes of a quantity divide; null for nobody. */
  value(key, link, bin) {
    if (key === "speed") return this.speedRatio(link, bin);
    const value = this[key](link, bin);
    return value > 0 ? value : null;
  }

  /** How much of the road is taken, by driving or by standing vehicles: 0 to 1. */
  shareOfRoad(link, bin) {
    const flow = this.volume(link, bin) / this.links.capacity_vph[link];
    const jam = this.density(link, bin) / this.links.jam_vpkm[link];
    return Math.min(Math.max(flow, jam), 1);
  }

  name(link) {
    return this.links.names[this.links.name[link]];
  }

  /** From when to when a time step goes, as the clock of all results tells it. */
  span(bin) {
    return this.content.spans[bin];
  }
}

/** A number with so many digits after the point at most, and at least, thousands apart; a dash for none. */
function told(value, digits = 0, least = 0) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return value.toLocaleString("en-GB", { maximumFractionDigits: digits, minimumFractionDigits: least });
}

/** An element with text or children; text never becomes HTML. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}
