// What a mechanical drawing is made of: springs, walls, axes.

import { digitsOf, fixed, niceStep } from "./format.js";
import { theme } from "./theme.js";

/** A spring along X1. */
export function zigzag(ctx, from, to, y, coils, high) {
  const lead = 0.12 * (to - from), step = (to - from - 2 * lead) / (2 * coils);
  ctx.beginPath();
  ctx.moveTo(from, y);
  ctx.lineTo(from + lead, y);
  for (let i = 0; i < 2 * coils; i++) ctx.lineTo(from + lead + step * (i + 0.5), y + (i % 2 ? -high : high));
  ctx.lineTo(to - lead, y);
  ctx.lineTo(to, y);
  ctx.stroke();
}

/** A wall to the right of `x`. */
export function hatch(ctx, x, y, high) {
  ctx.strokeStyle = theme.dim;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.moveTo(x, y);
  ctx.lineTo(x, y + high);
  for (let at = y + 4; at < y + high + 4; at += 8) {
    ctx.moveTo(x, at);
    ctx.lineTo(x + 6, at - 6);
  }
  ctx.stroke();
}

/** Grid and numbers of a plane in metres. */
export function axes(ctx, box, low, high, k) {
  const step = niceStep(48 / k), digits = digitsOf(step);
  const xs = [], ys = [];
  for (let i = Math.ceil(low[0] / step); i * step < high[0]; i++) xs.push(i * step);
  for (let i = Math.ceil(low[1] / step); i * step < high[1]; i++) ys.push(i * step);
  const x = (v) => Math.round(box.x + (v - low[0]) * k) + 0.5, y = (v) => Math.round(box.y + box.h - (v - low[1]) * k) + 0.5;
  ctx.strokeStyle = theme.grid;
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (const v of xs) ctx.moveTo(x(v), box.y), ctx.lineTo(x(v), box.y + box.h);
  for (const v of ys) ctx.moveTo(box.x, y(v)), ctx.lineTo(box.x + box.w, y(v));
  ctx.stroke();
  ctx.font = theme.small;
  ctx.fillStyle = theme.dim;
  ctx.textBaseline = "middle";
  ctx.textAlign = "right";
  for (const v of ys) ctx.fillText(fixed(v, digits), box.x - 5, y(v));
  ctx.textBaseline = "alphabetic";
  ctx.textAlign = "center";
  const name = box.x + box.w - 38;
  for (const v of xs) if (x(v) < name - 12 && x(v) > box.x + 4) ctx.fillText(fixed(v, digits), x(v), box.y + box.h + 14);
  ctx.textAlign = "right";
  ctx.fillText("X1 [m]", box.x + box.w, box.y + box.h + 14);
  ctx.textAlign = "left";
  ctx.fillText("X2 [m]", box.x + 5, box.y + 13);
}
