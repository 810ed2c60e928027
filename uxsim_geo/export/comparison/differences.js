"use strict";
// Unpacks differences as they are asked for, and answers what changes on a link.

const BOTH = 0, ONLY_BASE = 1, ONLY_SCENARIO = 2, ABSENT = 3;
const SIDES = 3;  // classes on either side of the one that hardly changes

/** Numbers of packing.py's packed_numbers: three bytes each, all lowest ones first. */
function unpackedNumbers(buffer) {
  const planes = new Uint8Array(buffer);
  const size = planes.length / 3;
  const bits = new Uint32Array(size);
  for (let i = 0; i < size; i++) {
    bits[i] = (planes[i] << 8) | (planes[i + size] << 16) | (planes[i + 2 * size] << 24);
  }
  return new Float32Array(bits.buffer);
}

/** The study: links, time steps, and what each scenario changes on them. */
class Differences {
  constructor(content, lines) {
    this.content = content;
    this.links = content.links;
    this.lines = lines;
    this.edges = content.edges;
    this.bins = content.edges.length - 1;
    this.kept = new Map();
    this.scenario = 0;
    this.quantity = 0;
    this.relative = false;
    this.values = { whole: [], time: [] };
  }

  static async load() {
    const content = JSON.parse(new TextDecoder().decode(await unpacked("document")));
    const counts = new Uint32Array(await unpacked("points"));
    const lines = unpackedLines(counts, new Uint8Array(await unpacked("places")));
    return new Differences(content, lines);
  }

  /** Take a scenario; its numbers of all quantities are unpacked once. */
  async take(scenario) {
    if (!this.kept.has(scenario)) {
      const of = async (kind, number) => unpackedNumbers(await unpacked(`${kind}-${scenario}-${number}`));
      const numbers = Array.from({ length: this.content.count }, (_, number) => number);
      this.kept.set(scenario, {
        whole: await Promise.all(numbers.map((number) => of("whole", number))),
        time: this.content.has_time ? await Promise.all(numbers.map((number) => of("time", number))) : [],
      });
    }
    this.scenario = scenario;
    this.values = this.kept.get(scenario);
  }

  /** A number of a link: in a time step, or over the whole run where bin is −1; null for none. */
  number(field, link, bin, quantity = this.quantity) {
    const kind = bin < 0 ? "whole" : "time";
    const fields = this.content.fields[kind];
    const row = bin < 0 ? link : link * this.bins + bin;
    const value = this.values[kind][quantity][row * fields.length + fields.indexOf(field)];
    return Number.isNaN(value) ? null : value;
  }

  /** Where the link exists: one of BOTH, ONLY_BASE, ONLY_SCENARIO, ABSENT. */
  kind(link) {
    return this.content.scenarios[this.scenario].kinds[link];
  }

  isEdited(link) {
    return this.content.scenarios[this.scenario].changed.includes(link);
  }

  /** The number of what is shown among all quantities with their classes. */
  shown(bin) {
    const { count } = this.content;
    if (this.relative) return count + this.quantity;
    return bin < 0 ? this.quantity : 2 * count + this.quantity;
  }

  /** The change that is shown, in the unit of its classes; null where there is none to tell. */
  change(link, bin) {
    const difference = this.number("difference", link, bin);
    if (!this.relative || difference === null) return difference;
    const base = this.number("base", link, bin);
    return base ? (100 * difference) / Math.abs(base) : null;
  }

  /** true: for sure, false: perhaps by chance, null: not known, as of one seed. */
  isSure(link, bin) {
    const sure = this.number("sure", link, bin);
    return sure === null ? null : sure > 0;
  }

  /** The class of a change, 0 to 6; symmetric about 0. */
  classOf(value, breaks) {
    let size = 0;
    while (size < breaks.length && Math.abs(value) >= breaks[size]) size += 1;
    return SIDES + Math.sign(value) * size;
  }

  name(link) {
    return this.links.names[this.links.name[link]];
  }

  span(bin) {
    return bin < 0 ? "whole run" : this.content.spans[bin];
  }

  /** Names and values of a link for the box beside the pointer. */
  figures(link, bin) {
    const kind = this.kind(link);
    if (kind === ONLY_BASE) return [["removed", "there is nothing to compare"], ...this.alone("base", link, bin)];
    if (kind === ONLY_SCENARIO) return [["added", "there is nothing to compare"], ...this.alone("scenario", link, bin)];
    const rows = [];
    for (let quantity = 0; quantity < this.content.count; quantity++) {
      rows.push([this.title(quantity, bin), this.compared(link, bin, quantity)]);
    }
    return this.isEdited(link) ? [["edited", "by the scenario"], ...rows] : rows;
  }

  title(quantity, bin) {
    const { title, unit } = this.content.quantities[(bin < 0 ? 0 : 2 * this.content.count) + quantity];
    return `${title}, ${unit}`;
  }

  /** Both values, the difference and its interval. */
  compared(link, bin, quantity) {
    const get = (field) => this.number(field, link, bin, quantity);
    const [base, scenario, difference, half] = ["base", "scenario", "difference", "half"].map(get);
    const both = `${shortly(base)} → ${shortly(scenario)}`;
    if (difference === null) return base === null && scenario === null ? "nobody there" : `${both}: not comparable`;
    const interval = half === null ? "" : ` (${shortly(difference - half)} to ${shortly(difference + half)})`;
    return `${both}: ${difference > 0 ? "+" : ""}${shortly(difference)}${interval}`;
  }

  alone(side, link, bin) {
    return Array.from({ length: this.content.count }, (_, quantity) => [
      this.title(quantity, bin), shortly(this.number(side, link, bin, quantity))]);
  }
}

/** A number with about three digits, and a real minus; a dash for none. */
function shortly(value) {
  if (value === null) return "–";
  const size = Math.abs(value);
  return told(value, size >= 99.95 ? 0 : size >= 9.995 ? 1 : size >= 0.9995 ? 2 : 3).replace("-", "−").replace(/^−0$/, "0");
}
