// One scope: its traces over time, its scale, its marks.

import { firstOf } from "./config.js";
import { digitsOf, fixed, niceStep, prefixed, quantity } from "./format.js";
import { HEAD, Header } from "./header.js";
import { theme } from "./theme.js";

const GUTTER = 46, RIGHT = 4;
const MOST_PIXELS = 8192;
/** A range shrinks when the data has needed less than this part of it for so long [ms]. */
const LOOSE = 0.55, PATIENCE = 1500;

export class Strip {
  constructor(spec, bench) {
    this.spec = spec;
    this.bench = bench;
    this.alone = false;
    this.manual = null;
    this.log = spec.scale === "log";
    this.shown = null;
    this._looseSince = 0;
    this._bounds = new Float64Array(2);
    this._out = new Float64Array(2);
    this.header = new Header(this);
    this.resolve();
  }

  /** Find the columns of the traces among those that the bench has. */
  resolve() {
    const { history, layout, units, meanings } = this.bench;
    const has = new Set(history.names);
    const { spec } = this;
    this.traces = [];
    spec.traces.forEach((names) => {
      const name = firstOf(names, has);
      const box = spec.of === "box" ? layout.boxes[name] : undefined;
      if (!name || (spec.of === "box" && !box)) return;
      const [a, b] = box ? [1 / (box[1] - box[0]), -box[0] / (box[1] - box[0])] : [1, 0];
      this.traces.push({
        name, c: history.place.get(name), a, b, index: this.traces.length, hidden: false,
        unit: units.get(name), meaning: meanings.get(name),
        low: new Float32Array(MOST_PIXELS), high: new Float32Array(MOST_PIXELS),
      });
    });
    this.unit = spec.of === "box" ? "" : (this.traces[0]?.unit ?? "");
    const limited = spec.limit && firstOf(spec.limit, new Set(Object.keys(layout.limits)));
    const ends = limited ? layout.limits[limited] : {};
    this.limits = [ends.lower, ends.upper].filter((v) => v !== null && v !== undefined);
    this.lines = spec.target ? [layout.geometry.x_md] : (spec.lines ?? []);
    this.counter = spec.counter && history.place.get(spec.counter);
    this.shown = null;
  }

  /** More traces than the header has room for. */
  get many() {
    return this.traces.length > 4;
  }

  get empty() {
    return this.traces.length === 0;
  }

  /** Where the plot itself lies, given the box of the strip. */
  plotOf(box) {
    return { x: box.x + GUTTER, y: box.y + HEAD, w: box.w - GUTTER - RIGHT, h: box.h - HEAD - 3 };
  }

  /** Least and greatest of each trace in each column of pixels; the range over all of them. */
  _reduce(left, right, pixels) {
    const { history, end } = this.bench;
    const per = (right - left) / pixels;
    let size = Math.max(1, Math.round(per));
    // Whole bins, so that a wide bucket reads nothing twice; fixed in time, so nothing shimmers.
    if (size >= 1024) size = Math.round(size / 256) * 256;
    else if (size >= 64) size = Math.round(size / 16) * 16;
    const from = Math.floor(Math.max(left, history.oldest) / size);
    // Not a row beyond the right edge: what is paused stays as it was.
    const stop = Math.min(end, Math.ceil(right));
    const upto = Math.min(Math.ceil(stop / size), from + MOST_PIXELS);
    let lo = Infinity, hi = -Infinity, least = Infinity;
    for (const trace of this.traces) {
      if (trace.hidden) continue;
      const { c, a, b, low, high } = trace;
      for (let k = from; k < upto; k++) {
        history.range(c, k * size, Math.min((k + 1) * size, stop), this._out);
        const l = this._out[0] * a + b, h = this._out[1] * a + b;
        low[k - from] = l;
        high[k - from] = h;
        if (l < lo) lo = l;
        if (h > hi) hi = h;
        if (l > 0 && l < least) least = l;
      }
    }
    this._bounds[0] = lo;
    this._bounds[1] = hi;
    this._least = least;
    return { size, from, upto };
  }

  /** The range of the axis: that of the data, widened to round numbers, held against jitter. */
  _range(height, now) {
    let [lo, hi] = this._bounds;
    if (this.manual) return this.manual;
    if (this.log) return this._logRange(hi, now);
    for (const v of this.spec.include ?? []) {
      lo = Math.min(lo, v);
      hi = Math.max(hi, v);
    }
    if (!(hi >= lo)) [lo, hi] = this.shown ?? [0, 1];
    // A limit that the data comes near is in sight.
    const size = Math.max(Math.abs(lo), Math.abs(hi));
    for (const v of [...this.limits, ...this.lines]) {
      if (v < lo && lo - v < 0.6 * (hi - v)) lo = v;
      if (v > hi && v - hi < 0.6 * (v - lo)) hi = v;
    }
    const room = 0.06 * (hi - lo) || 0.1 * size || 1e-9;
    const step = niceStep((hi - lo + 2 * room) / Math.max(2, height / 30)) / 2;
    const asked = [Math.floor((lo - room) / step) * step, Math.ceil((hi + room) / step) * step];
    // What never changes its sign stands on its zero.
    if (lo === 0) asked[0] = -0.05 * asked[1];
    if (hi === 0) asked[1] = -0.05 * asked[0];
    this.shown = this.wasLog || !this.shown ? asked : this._held(asked, lo, hi, now, this.shown);
    this.wasLog = false;
    return this.shown;
  }

  /** The range asked for if the one that is held is too narrow, or was far too wide for long. */
  _held(asked, lo, hi, now, held) {
    const span = held[1] - held[0];
    if (lo < held[0] || hi > held[1]) {
      this._looseSince = now;
      return [Math.min(asked[0], held[0]), Math.max(asked[1], held[1])];
    }
    if (asked[1] - asked[0] > LOOSE * span) this._looseSince = now;
    return now - this._looseSince > (this._still ? -1 : PATIENCE) ? asked : held;
  }

  _logRange(hi, now) {
    if (!(hi > 0)) return (this.shown = this.wasLog && this.shown ? this.shown : [1e-3, 1]);
    // Quarters of decades; a twelfth of one at least between the data and the border.
    const low = Math.max(this._least, hi * 1e-12);
    const asked = [10 ** (Math.floor(Math.log10(low) * 4 - 0.33) / 4), 10 ** (Math.ceil(Math.log10(hi) * 4 + 0.33) / 4)];
    if (!this.wasLog || !this.shown) this.shown = asked;
    const logs = [...asked, low, hi].map(Math.log10), held = this.shown.map(Math.log10);
    this.shown = this._held(logs.slice(0, 2), logs[2], logs[3], now, held).map((v) => 10 ** v);
    this.wasLog = true;
    return this.shown;
  }

  /** Draw within a box; `view` holds rows left and right, the time axis, and what is shown. */
  draw(ctx, box, view, now) {
    const plot = this.plotOf(box);
    const ratio = view.ratio;
    // What a person changed is fitted at once; the patience is for traces that run by.
    this._still = view.paused;
    const asked = `${view.span} ${Math.round(plot.h)}`;
    if (asked !== this._asked) this.shown = null;
    this._asked = asked;
    if (this.spec.target) this.lines[0] = this.bench.target(Math.min(view.right, this.bench.end) - 1);
    const reduced = this._reduce(view.left, view.right, Math.min(MOST_PIXELS - 4, Math.max(1, Math.round(plot.w * ratio))));
    const range = this._range(plot.h, now);
    this.scale = this._scale(plot, range);
    this.plot = plot;
    this.box = box;
    ctx.fillStyle = theme.plot;
    ctx.fillRect(plot.x, plot.y, plot.w, plot.h);
    ctx.save();
    ctx.beginPath();
    ctx.rect(plot.x, plot.y, plot.w, plot.h);
    ctx.clip();
    view.shade(ctx, plot);
    this._grid(ctx, plot, view);
    view.marks(ctx, plot);
    this._limits(ctx, plot);
    for (let i = this.traces.length - 1; i >= 0; i--) {
      if (!this.traces[i].hidden) this._trace(ctx, plot, view, reduced, this.traces[i]);
    }
    this._misses(ctx, plot, view);
    view.cursors(ctx, plot, this);
    if (this.alone && this.many) this.header.table(ctx, plot, view);
    ctx.restore();
    this._labels(ctx, plot);
    this.header.draw(ctx, box, view);
  }

  _scale(plot, [lo, hi]) {
    const { y, h } = plot;
    if (this.log) {
      const a = Math.log10(lo), b = Math.log10(hi);
      return { lo, hi, y: (v) => y + h - ((Math.log10(Math.max(v, lo * 1e-3)) - a) / (b - a)) * h };
    }
    const k = h / (hi - lo);
    return { lo, hi, y: (v) => y + h - (v - lo) * k };
  }

  /** Value at a height; for zooming by hand. */
  valueAt(py) {
    const { lo, hi } = this.scale, part = (this.plot.y + this.plot.h - py) / this.plot.h;
    return this.log ? lo * (hi / lo) ** part : lo + part * (hi - lo);
  }

  _ticks(plot) {
    const { lo, hi } = this.scale;
    const found = [];
    if (this.log) {
      const decades = Math.log10(hi / lo), every = Math.max(1, Math.ceil((decades * 16) / plot.h));
      const leads = decades < 1.6 ? [1, 2, 5] : [1];
      for (let p = Math.floor(Math.log10(lo)); p <= Math.log10(hi); p += every) {
        for (const lead of leads) if (lead * 10 ** p >= lo && lead * 10 ** p <= hi) found.push(lead * 10 ** p);
      }
      return { found, step: 0 };
    }
    let step = niceStep((hi - lo) / Math.max(2, plot.h / (plot.h < 130 ? 17 : 24)));
    const edge = 0.04 * (hi - lo);
    const inside = () => Math.floor((hi - edge) / step) - Math.ceil((lo + edge) / step) + 1;
    if (inside() < 3 && plot.h > 50) step = niceStep(step / 2.6);
    for (let k = Math.ceil(lo / step - 1e-6); k * step <= hi + step * 1e-6; k++) found.push(k * step);
    return { found, step };
  }

  _grid(ctx, plot, view) {
    this._tick = this._ticks(plot);
    ctx.strokeStyle = theme.grid;
    ctx.lineWidth = 1;
    ctx.beginPath();
    for (const v of this._tick.found) {
      const y = Math.round(this.scale.y(v)) + 0.5;
      ctx.moveTo(plot.x, y);
      ctx.lineTo(plot.x + plot.w, y);
    }
    for (const row of view.ticks) {
      const x = Math.round(view.x(plot, row)) + 0.5;
      ctx.moveTo(x, plot.y);
      ctx.lineTo(x, plot.y + plot.h);
    }
    ctx.stroke();
    if (!this.log && this.scale.lo < 0 && this.scale.hi > 0) {
      ctx.strokeStyle = theme.axis;
      ctx.beginPath();
      const y = Math.round(this.scale.y(0)) + 0.5;
      ctx.moveTo(plot.x, y);
      ctx.lineTo(plot.x + plot.w, y);
      ctx.stroke();
    }
  }

  _limits(ctx, plot) {
    const across = (v, colour, dash) => {
      if (v < this.scale.lo || v > this.scale.hi) return;
      const y = Math.round(this.scale.y(v)) + 0.5;
      ctx.strokeStyle = colour;
      ctx.setLineDash(dash);
      ctx.beginPath();
      ctx.moveTo(plot.x, y);
      ctx.lineTo(plot.x + plot.w, y);
      ctx.stroke();
    };
    ctx.lineWidth = 1;
    for (const v of this.lines) across(v, theme.dim, [2, 3]);
    ctx.lineWidth = 1.25;
    for (const v of this.limits) across(v, theme.limit, [7, 4]);
    ctx.setLineDash([]);
    this._beyond(ctx, plot);
  }

  /** Limits beyond the axis are told in words, on the side where they are. */
  _beyond(ctx, plot) {
    ctx.font = theme.small;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.fillStyle = theme.limit;
    for (const v of this.limits) {
      if (v > this.scale.hi) ctx.fillText(`▴ limit ${quantity(v, this.unit)}`, plot.x + 6, plot.y + 13);
      if (v < this.scale.lo) ctx.fillText(`▾ limit ${quantity(v, this.unit)}`, plot.x + 6, plot.y + plot.h - 5);
    }
  }

  _trace(ctx, plot, view, { size, from, upto }, trace) {
    const { low, high } = trace, { scale } = this;
    const k = plot.w / (view.right - view.left);
    const wide = k * size;
    ctx.strokeStyle = theme.trace(trace.index);
    ctx.lineWidth = this.spec.wide === trace.index ? 3 : 1.3;
    ctx.lineJoin = "bevel";
    ctx.beginPath();
    let down = false, last = 0;
    for (let i = 0; i < upto - from; i++) {
      const l = low[i], h = high[i];
      if (l !== l) {
        down = false;
        continue;
      }
      // The newest bucket may not be full yet: its middle can lie beyond the border.
      const x = Math.min(plot.x + ((from + i) * size + size / 2 - view.left) * k, plot.x + plot.w - 1.2);
      const a = scale.y(l), b = scale.y(h);
      // A lone bucket after a gap is still a stroke of one pixel.
      if (!down) ctx.moveTo(x - 0.5, Math.abs(a - last) < Math.abs(b - last) ? a : b);
      const near = Math.abs(a - last) <= Math.abs(b - last) ? a : b;
      ctx.lineTo(x, near);
      if (Math.abs(a - b) > 0.4) ctx.lineTo(x, (last = near === a ? b : a));
      else last = near;
      down = true;
    }
    ctx.stroke();
    if (size === 1 && wide > 6) this._dots(ctx, plot, view, from, upto, k, trace);
  }

  _dots(ctx, plot, view, from, upto, k, trace) {
    ctx.fillStyle = theme.trace(trace.index);
    for (let i = 0; i < upto - from; i++) {
      const v = trace.low[i];
      if (v !== v) continue;
      ctx.fillRect(plot.x + (from + i + 0.5 - view.left) * k - 1.5, this.scale.y(v) - 1.5, 3, 3);
    }
  }

  _misses(ctx, plot, view) {
    if (!this.counter) return;
    const { misses } = this.bench.marks;
    ctx.fillStyle = theme.limit;
    for (let i = misses.length - 1; i >= 0 && misses[i] >= view.left; i--) {
      if (misses[i] < view.right) ctx.fillRect(view.x(plot, misses[i]) - 1, plot.y + plot.h - 9, 2, 9);
    }
  }

  _labels(ctx, plot) {
    const { found, step } = this._tick;
    const { lo, hi } = this.scale;
    const [factor, unit] = this.log ? [1, prefixed(this.unit, 1)[1]] : prefixed(this.unit, Math.max(Math.abs(lo), Math.abs(hi)));
    this.factor = factor;
    this.digits = this.log ? 0 : digitsOf(step / factor);
    ctx.font = theme.small;
    ctx.textAlign = "right";
    ctx.textBaseline = "middle";
    ctx.fillStyle = theme.dim;
    for (const v of found) {
      const y = this.scale.y(v);
      if (y < plot.y + 3 || y > plot.y + plot.h - 2) continue;
      const text = this.log ? power(v) : fixed(v / factor, this.digits);
      ctx.fillText(text, plot.x - 5, y);
    }
    if (this.manual) {
      ctx.fillStyle = theme.warn;
      ctx.fillText("man", plot.x - 5, plot.y + plot.h - 4);
    }
    ctx.strokeStyle = theme.border;
    ctx.lineWidth = 1;
    ctx.strokeRect(plot.x + 0.5, plot.y + 0.5, plot.w - 1, plot.h - 1);
    ctx.textBaseline = "alphabetic";
    ctx.fillStyle = theme.dim;
    ctx.fillText(unit, plot.x - 5, plot.y - 5);
  }
}

/** A tick of a logarithmic scale: 0.2, 5, 1e4. */
function power(v) {
  const p = Math.floor(Math.log10(v) + 1e-9), lead = Math.round(v / 10 ** p);
  return p >= -2 && p <= 3 ? String(Number((lead * 10 ** p).toFixed(2))) : `${lead}e${p}`.replace("-", "−");
}
