// What stands above a scope: its title, and its traces by name with their values.

import { fixed, significant } from "./format.js";
import { theme } from "./theme.js";

/** Height of a header. */
export const HEAD = 19;

export class Header {
  constructor(strip) {
    this.strip = strip;
  }

  /** Value of a trace as the header shows it, in the unit of the axis. */
  value(trace, row) {
    const v = this.strip.bench.history.at(trace.c, row);
    if (this.strip.spec.of === "box") return significant(v, 4);
    if (this.strip.log) return significant(v, 3);
    return v === v ? fixed(v / this.strip.factor, this._places()) : "–";
  }

  draw(ctx, box, view) {
    const y = box.y + HEAD - 5, { x, w } = this.strip.plot;
    let right = x + w - 20; // the button that enlarges
    ctx.textBaseline = "alphabetic";
    const { many } = this.strip;
    ctx.font = theme.small;
    ctx.textAlign = "right";
    if (this.strip.counter) right = this._word(ctx, right - 6, y, theme.text, `missed ${fixed(this.strip.bench.history.at(this.strip.counter, view.shown) || 0, 0)}`) - 10;
    const places = [];
    for (let i = this.strip.traces.length - 1; i >= 0; i--) {
      const trace = this.strip.traces[i];
      const name = many ? trace.name.replace("theta_dk_hat", "dk").replace("theta_r_hat", "") : trace.name;
      const colour = trace.hidden ? theme.axis : theme.trace(trace.index);
      const end = right;
      if (!many) {
        ctx.fillStyle = theme.text;
        ctx.fillText(trace.hidden ? "off" : this.value(trace, view.shown), right, y);
        right -= Math.max(this._slot(ctx), 24);
      }
      right = this._word(ctx, right, y, colour, name) - (many ? 7 : 9);
      places.push({ trace, from: right, upto: end });
    }
    this.strip.legend = places;
    ctx.textAlign = "left";
    ctx.font = theme.bold;
    ctx.fillStyle = theme.text;
    const room = right - x - 4;
    const title = clipped(ctx, this.strip.spec.title, room);
    if (title) ctx.fillText(title, x, y);
  }

  /** All traces with their values, where the header has no room for them. */
  table(ctx, plot, view) {
    const high = 16, wide = 216, x = plot.x + plot.w - wide - 8;
    let y = plot.y + 8;
    ctx.globalAlpha = 0.86;
    ctx.fillStyle = theme.panel;
    ctx.fillRect(x, y, wide, high * (this.strip.traces.length + 1) + 8);
    ctx.globalAlpha = 1;
    ctx.font = theme.small;
    ctx.textBaseline = "alphabetic";
    const line = (colour, ...words) => {
      y += high;
      [["left", 8], ["right", 136], ["right", wide - 8]].forEach(([align, at], i) => {
        ctx.fillStyle = i ? theme.text : colour;
        ctx.textAlign = align;
        ctx.fillText(words[i], x + at, y);
      });
    };
    line(theme.dim, "", this.strip.spec.of === "box" ? "in bounds" : "", "value");
    for (const trace of this.strip.traces) {
      const v = this.strip.bench.history.at(trace.c, view.shown);
      const colour = trace.hidden ? theme.axis : theme.trace(trace.index);
      line(colour, trace.name, this.strip.spec.of === "box" ? significant(v * trace.a + trace.b, 3) : "", significant(v, 5));
    }
  }

  /** Digits before the point that the axis has room for; those after it fill up what is left. */
  _whole() {
    const size = Math.max(Math.abs(this.strip.scale.lo), Math.abs(this.strip.scale.hi)) / (this.strip.factor || 1);
    return Math.max(1, Math.floor(Math.log10(Math.max(size, 1))) + 1);
  }

  _places() {
    const all = (this.strip.plot.w > 330 ? 8 : 7) - Math.min(3, this.strip.traces.length);
    return Math.min(6, Math.max(this.strip.digits, all - this._whole(), 0));
  }

  _slot(ctx) {
    const digits = this._places(), whole = this._whole();
    const text = this.strip.spec.of === "box" ? "−0.00000" : this.strip.log ? "0.0e−00" : `${this.strip.scale.lo < -0.1 * this.strip.scale.hi ? "−" : ""}${"0".repeat(whole)}.${"0".repeat(digits)}`;
    return ctx.measureText(text).width + 5;
  }

  _word(ctx, right, y, colour, text) {
    ctx.fillStyle = colour;
    ctx.fillText(text, right, y);
    return right - ctx.measureText(text).width;
  }
}

function clipped(ctx, text, room) {
  if (ctx.measureText(text).width <= room) return text;
  while (text.length > 2 && ctx.measureText(text + "…").width > room) text = text.slice(0, -1);
  return text.length > 2 ? text.trimEnd() + "…" : "";
}
