// The contact, magnified along X1: tip, plate on its stiff spring, probe; and what they measure.

import { digitsOf, fixed, niceStep, prefixed, quantity } from "./format.js";
import { zigzag } from "./sketch.js";
import { theme } from "./theme.js";

/** Half widths of the magnified view [m]: the smallest that holds the tip, kept for a while. */
const WIDTHS = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5];
const CALM = 30;
/** Rows between two drawings beyond which time did not simply pass. */
const LEAP = 400;
const ROW = 17;

export class Contact {
  constructor() {
    this._width = 0;
    this._calm = 0;
    this._row = 0;
  }

  draw(ctx, box, pose) {
    const words = 4 * ROW + 46;
    const drawing = { x: box.x + 6, y: box.y + 20, w: box.w - 12, h: Math.max(50, box.h - words - 20) };
    ctx.font = theme.bold;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.fillStyle = theme.text;
    ctx.fillText("contact", box.x + 6, box.y + 13);
    ctx.font = theme.small;
    ctx.textAlign = "right";
    ctx.fillStyle = pose.touch ? theme.contact : theme.dim;
    ctx.fillText(pose.touch ? "● pressing" : "○ free", box.x + box.w - 6, box.y + 13);
    this._magnified(ctx, drawing, pose);
    this._gauge(ctx, { x: box.x + 6, y: drawing.y + drawing.h + 22, w: box.w - 12 }, pose);
    this._words(ctx, { x: box.x + 6, y: drawing.y + drawing.h + 54, w: box.w - 12 }, pose);
  }

  /** Scale of the drawing; a wider one at once, a narrower one after a while. */
  _scale({ row, gap, most, clearance }) {
    const need = Math.max(Math.abs(gap) * 1.15, 1.25 * most * (gap > -2 * most ? 1 : 0), 1e-4, gap > 0 ? (most - clearance) * 1.3 : 0);
    const asked = WIDTHS.find((w) => w >= need) ?? WIDTHS.at(-1);
    // Another instant was chosen: nothing to keep calm.
    const leapt = Math.abs(row - this._row) > LEAP;
    this._row = row;
    if (asked >= this._width || leapt) [this._width, this._calm] = [asked, 0];
    else if (++this._calm > CALM) [this._width, this._calm] = [asked, 0];
    return this._width;
  }

  _magnified(ctx, box, pose) {
    const half = this._scale(pose), k = (0.5 * box.w) / half;
    const zero = box.x + 0.5 * box.w, x = (v) => zero + v * k;
    ctx.fillStyle = theme.plot;
    ctx.fillRect(box.x, box.y, box.w, box.h);
    ctx.save();
    ctx.beginPath();
    ctx.rect(box.x, box.y, box.w, box.h);
    ctx.clip();
    this._ruler(ctx, box, half, x);
    const middle = box.y + 0.46 * box.h, high = 0.7 * box.h, top = middle - high / 2;
    const face = x(pose.deflection), plate = 7, stop = x(pose.most) + plate;
    const back = box.x + box.w - 8;
    // The probe stands on the mass; its gap to the plate is the clearance.
    ctx.fillStyle = theme.body;
    ctx.strokeStyle = theme.axis;
    ctx.lineWidth = 1;
    ctx.fillRect(stop, middle - 9, Math.max(0, back - stop), 18);
    ctx.strokeRect(stop + 0.5, middle - 8.5, Math.max(0, back - stop), 17);
    ctx.font = theme.small;
    ctx.fillStyle = theme.dim;
    ctx.textAlign = "right";
    ctx.textBaseline = "alphabetic";
    ctx.fillText("probe", back - 6, middle - 14);
    if (high > 96) ctx.fillText("K_I", back - 6, top + 0.14 * high + 18);
    ctx.strokeStyle = theme.dim;
    ctx.lineWidth = 1.2;
    for (const part of [0.14, 0.86]) zigzag(ctx, face + plate, back, top + part * high, 6, 4);
    ctx.fillStyle = theme.body;
    ctx.fillRect(back, top - 4, 8, high + 8);
    ctx.fillStyle = pose.clearance <= 0 ? theme.limit : pose.touch ? theme.contact : theme.dim;
    ctx.fillRect(face, top, plate, high);
    this._tip(ctx, box, x(pose.gap), middle, pose);
    ctx.restore();
    ctx.strokeStyle = theme.border;
    ctx.lineWidth = 1;
    ctx.strokeRect(box.x + 0.5, box.y + 0.5, box.w - 1, box.h - 1);
  }

  _tip(ctx, box, x, y, { touch }) {
    ctx.fillStyle = theme.body;
    ctx.strokeStyle = theme.axis;
    ctx.lineWidth = 1;
    ctx.fillRect(box.x - 2, y - 6, Math.max(0, x - box.x - 12), 12);
    ctx.strokeRect(box.x - 2, y - 6.5, Math.max(0, x - box.x - 12), 13);
    ctx.beginPath();
    ctx.arc(x - 11, y, 11, 0, 2 * Math.PI);
    ctx.fillStyle = touch ? theme.contact : theme.trace(1);
    ctx.fill();
    ctx.strokeStyle = theme.plot;
    ctx.stroke();
  }

  _ruler(ctx, box, half, x) {
    const [factor, unit] = prefixed("m", half);
    const step = niceStep((2 * half) / (box.w / 46));
    ctx.font = theme.small;
    ctx.textAlign = "center";
    ctx.textBaseline = "alphabetic";
    for (let i = Math.ceil(-half / step); i * step <= half; i++) {
      const at = Math.round(x(i * step)) + 0.5;
      ctx.strokeStyle = i ? theme.grid : theme.axis;
      ctx.lineWidth = 1;
      ctx.beginPath();
      ctx.moveTo(at, box.y);
      ctx.lineTo(at, box.y + box.h - 16);
      ctx.stroke();
      ctx.fillStyle = theme.dim;
      const text = fixed((i * step) / factor, digitsOf(step / factor));
      const w = ctx.measureText(text).width / 2;
      if (at - w > box.x + 2 && at + w < box.x + box.w - 26) ctx.fillText(text, at, box.y + box.h - 4);
    }
    ctx.textAlign = "right";
    ctx.fillText(unit, box.x + box.w - 4, box.y + box.h - 4);
  }

  /** How much of the probe's clearance is left. */
  _gauge(ctx, { x, y, w }, { clearance, most }) {
    const part = Math.max(0, Math.min(1, clearance / most));
    const colour = clearance <= 0 ? theme.limit : part < 0.15 ? theme.warn : theme.good;
    ctx.font = theme.small;
    ctx.textBaseline = "alphabetic";
    ctx.textAlign = "left";
    ctx.fillStyle = theme.dim;
    ctx.fillText("clearance left", x, y - 4);
    ctx.textAlign = "right";
    ctx.fillStyle = clearance <= 0 ? theme.limit : theme.text;
    ctx.fillText(clearance <= 0 ? `PROBE TOUCHED  ${quantity(clearance, "m")}` : `${quantity(clearance, "m")} of ${quantity(most, "m")}`, x + w, y - 4);
    ctx.fillStyle = theme.body;
    ctx.fillRect(x, y, w, 7);
    ctx.fillStyle = colour;
    ctx.fillRect(x, y, w * part, 7);
  }

  _words(ctx, { x, y, w }, pose) {
    const { gap, F_m, F_t, x_m, tip, q1, q2 } = pose;
    const left = [["gap", quantity(gap, "m")], ["F_m", quantity(F_m, "N")], ["F_t", quantity(F_t, "N")], ["x_m", quantity(x_m, "m")]];
    const right = [["x_r1", quantity(tip[0], "m")], ["x_r2", quantity(tip[1], "m")], ["q1", quantity(q1, "rad")], ["q2", quantity(q2, "rad")]];
    const half = (w - 14) / 2;
    [left, right].forEach((list, side) => {
      list.forEach(([name, value], i) => {
        const at = y + i * ROW, from = x + side * (half + 14);
        ctx.textAlign = "left";
        ctx.fillStyle = theme.dim;
        ctx.fillText(name, from, at);
        ctx.textAlign = "right";
        ctx.fillStyle = theme.text;
        ctx.fillText(value, from + half, at);
      });
    });
  }
}
