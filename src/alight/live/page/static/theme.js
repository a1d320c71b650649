// The colours and fonts in force, read from the style sheet; renewed when the page turns over.

const NAMES = ["ground", "panel", "plot", "border", "grid", "axis", "text", "dim", "accent", "limit", "good", "warn", "contact", "cursor", "body", "shade"];
const TRACES = 8;

class Theme extends EventTarget {
  constructor() {
    super();
    this.read();
    new MutationObserver(() => this.read()).observe(document.documentElement, { attributes: true, attributeFilter: ["data-theme", "class", "style"] });
    matchMedia("(prefers-contrast: more)").addEventListener("change", () => this.read());
  }

  read() {
    const style = getComputedStyle(document.documentElement);
    const of = (name) => style.getPropertyValue(`--al-${name}`).trim();
    for (const name of NAMES) this[name] = of(name);
    this.traces = Array.from({ length: TRACES }, (_, i) => of(`trace-${i + 1}`));
    const font = of("font") || "sans-serif";
    this.font = `12px ${font}`;
    this.small = `11px ${font}`;
    this.bold = `600 12px ${font}`;
    this.large = `600 20px ${font}`;
    this.dispatchEvent(new Event("change"));
  }

  trace(i) {
    return this.traces[i % this.traces.length];
  }
}

export const theme = new Theme();

/** Calls `draw` at most 30 times a second, and only when something has changed. */
export class Painter {
  constructor(draw) {
    this._draw = draw;
    this._wanted = false;
    this._last = 0;
    this.frames = 0;
    this.busy = 0;
    this._frame = this._frame.bind(this);
  }

  want() {
    if (this._wanted) return;
    this._wanted = true;
    requestAnimationFrame(this._frame);
  }

  _frame(now) {
    // A display of 60 Hz: every second frame. Half a frame of slack keeps the rhythm.
    if (now - this._last < 1000 / 30 - 8) {
      requestAnimationFrame(this._frame);
      return;
    }
    this._last = now;
    this._wanted = false;
    const began = performance.now();
    this._draw();
    this.frames++;
    this.busy += performance.now() - began;
  }
}

/** Give a canvas as many pixels as the screen has in its box; returns whether that changed. */
export function fit(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const w = Math.max(1, Math.round(width * ratio)), h = Math.max(1, Math.round(height * ratio));
  if (canvas.width === w && canvas.height === h) return false;
  canvas.width = w;
  canvas.height = h;
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  return true;
}
