// What lies over the traces of all scopes at one time: contact, events, cursors.

import { fixed, quantity } from "./format.js";
import { theme } from "./theme.js";

const NAMES = ["A", "B"];

export class Overlay {
  constructor(scopes) {
    this.scopes = scopes;
    this.drag = null;
  }

  /** The ground of the plot while the tip presses. */
  shade(ctx, plot) {
    const { view, bench } = this.scopes;
    ctx.fillStyle = theme.shade;
    this._contacts((from, upto) => {
      const x = view.x(plot, from), w = view.x(plot, upto) - x;
      ctx.fillRect(x, plot.y, Math.max(w, 0.5), plot.h);
    }, view, bench);
  }

  _contacts(draw, view, bench) {
    const { contacts } = bench.marks;
    for (let i = contacts.length - 1; i >= 0; i--) {
      const [from, end] = contacts[i];
      const upto = Math.min(end, bench.end);
      if (upto < view.left) break;
      if (from < view.right) draw(Math.max(from, view.left - 1), Math.min(upto, view.right + 1));
    }
  }

  _within(draw) {
    const { view, bench } = this.scopes, { list } = bench.marks;
    for (let i = list.length - 1; i >= 0; i--) {
      const mark = list[i];
      if (mark.row >= view.left && mark.row < view.right && mark.row <= bench.end) draw(mark);
      if (mark.row < view.left - 4000) break;
    }
  }

  colour(mark) {
    return mark.kind === "trip" ? theme.limit : mark.kind === "kick" ? theme.warn : theme.accent;
  }

  /** A line down each plot where something happened. */
  marks(ctx, plot) {
    const { view } = this.scopes;
    ctx.lineWidth = 1;
    ctx.setLineDash([3, 2]);
    this._within((mark) => {
      ctx.strokeStyle = this.colour(mark);
      const x = Math.round(view.x(plot, mark.row - 0.5)) + 0.5;
      ctx.beginPath();
      ctx.moveTo(x, plot.y);
      ctx.lineTo(x, plot.y + plot.h);
      ctx.stroke();
    });
    ctx.setLineDash([]);
  }

  /** The lane above the plots: contact as a bar, events by name. */
  lane(ctx, plot, view, y) {
    const { bench } = this.scopes;
    ctx.save();
    ctx.beginPath();
    ctx.rect(plot.x, y, plot.w, 17);
    ctx.clip();
    ctx.fillStyle = theme.contact;
    let widest = 0, middle = 0;
    this._contacts((from, upto) => {
      const a = Math.max(view.x(plot, from), plot.x), b = Math.min(view.x(plot, upto), plot.x + plot.w);
      ctx.fillRect(a, y + 14, Math.max(b - a, 1), 3);
      if (b - a > widest) [widest, middle] = [b - a, (a + b) / 2];
    }, view, bench);
    ctx.font = theme.small;
    ctx.textBaseline = "alphabetic";
    const taken = [];
    // The newest first: where words would overlap, the older ones give way.
    this._within((mark) => this._label(ctx, view.x(plot, mark.row), y + 11, mark.label, this.colour(mark), plot, taken));
    if (widest > 60) this._label(ctx, middle, y + 11, "contact", theme.contact, plot, taken, true);
    ctx.restore();
  }

  _label(ctx, x, y, text, colour, plot, taken, centred = false) {
    const w = ctx.measureText(text).width;
    let at = centred ? x - w / 2 : x + 2;
    if (at + w > plot.x + plot.w) at = plot.x + plot.w - w;
    if (taken.some(([a, b]) => at < b + 6 && at + w > a - 6)) return;
    taken.push([at, at + w]);
    ctx.textAlign = "left";
    ctx.fillStyle = colour;
    ctx.fillText(text, at, y);
  }

  /** The pointer's line, both cursors, the span that is being drawn out. */
  cursors(ctx, plot, strip) {
    const { time, view, bench } = this.scopes;
    if (this.drag) {
      const [a, b] = this.drag.map((row) => view.x(plot, row));
      ctx.fillStyle = theme.accent;
      ctx.globalAlpha = 0.18;
      ctx.fillRect(Math.min(a, b), plot.y, Math.abs(b - a), plot.h);
      ctx.globalAlpha = 1;
    }
    if (time.hover !== null && time.hover < bench.end) this._line(ctx, plot, view.x(plot, time.hover), theme.axis);
    time.cursors.forEach((row, i) => {
      if (row === null) return;
      const x = view.x(plot, row);
      this._line(ctx, plot, x, theme.cursor);
      ctx.font = theme.small;
      ctx.fillStyle = theme.cursor;
      ctx.textAlign = "left";
      ctx.textBaseline = "alphabetic";
      ctx.fillText(NAMES[i], x + 3, plot.y + 11);
    });
    this._between(ctx, plot, strip);
  }

  _line(ctx, plot, x, colour) {
    ctx.strokeStyle = colour;
    ctx.lineWidth = 1;
    ctx.beginPath();
    ctx.moveTo(Math.round(x) + 0.5, plot.y);
    ctx.lineTo(Math.round(x) + 0.5, plot.y + plot.h);
    ctx.stroke();
  }

  /** With two cursors each plot tells the differences of its traces. */
  _between(ctx, plot, strip) {
    const { time, bench } = this.scopes;
    const [a, b] = time.cursors;
    if (a === null || b === null) return;
    let y = plot.y + plot.h - 6;
    ctx.font = theme.small;
    ctx.textAlign = "right";
    const shown = strip.traces.filter((t) => !t.hidden);
    if (shown.length > 4 && plot.h < 250) return;
    for (const trace of [...shown].reverse()) {
      const d = bench.history.at(trace.c, b) - bench.history.at(trace.c, a);
      const text = `Δ ${quantity(d, strip.spec.of === "box" ? "" : trace.unit)}`;
      ctx.globalAlpha = 0.75;
      ctx.fillStyle = theme.plot;
      ctx.fillRect(plot.x + plot.w - ctx.measureText(text).width - 8, y - 11, ctx.measureText(text).width + 6, 14);
      ctx.globalAlpha = 1;
      ctx.fillStyle = theme.trace(trace.index);
      ctx.fillText(text, plot.x + plot.w - 5, y);
      y -= 14;
    }
  }

  /** What a mark near a place of the lane says in full. */
  told(x) {
    const { view } = this.scopes;
    let found = "";
    for (const { strip } of this.scopes.placed ?? []) {
      if (!strip.plot || x < strip.plot.x || x > strip.plot.x + strip.plot.w) continue;
      this._within((mark) => {
        if (!found && Math.abs(view.x(strip.plot, mark.row) - x) < 6) {
          const at = `${fixed(this.scopes.time.seconds(mark.row), 4)} s, row ${mark.row}`;
          found = [`${mark.label} at ${at}`, mark.full].filter(Boolean).join("\n");
        }
      });
    }
    return found;
  }
}
