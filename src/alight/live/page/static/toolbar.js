// The bar above the scopes: pause, window, cursors, which scopes; and a button on each of them.

import { WINDOWS } from "./config.js";
import { duration } from "./format.js";

const STYLE = `
:host { display: block; position: relative; background: var(--al-ground); color: var(--al-text);
  font: 12px/1.3 var(--al-font); }
canvas { display: block; outline: none; touch-action: none; }
.bar { display: flex; align-items: center; gap: 6px; height: 34px; padding: 0 4px 0 2px; box-sizing: border-box;
  white-space: nowrap; }
button, select, summary { font: inherit; color: var(--al-text); background: var(--al-panel);
  border: 1px solid var(--al-border); border-radius: 4px; height: 24px; padding: 0 8px; cursor: pointer;
  box-sizing: border-box; line-height: 22px; }
select { padding: 0 2px; }
button:hover, summary:hover, select:hover { border-color: var(--al-axis); }
:is(button, select, summary, canvas):focus-visible { outline: 2px solid var(--al-accent); outline-offset: 1px; }
.pause { min-width: 74px; font-weight: 600; }
.pause.held { color: var(--al-ground); background: var(--al-warn); border-color: var(--al-warn); }
.square { width: 26px; padding: 0; text-align: center; font-size: 14px; }
.told { flex: 1; min-width: 0; overflow: hidden; text-overflow: ellipsis; color: var(--al-dim); white-space: pre;
  font-variant-numeric: tabular-nums; text-align: right; }
.told.problem { color: var(--al-warn); font-weight: 600; }
details { position: relative; }
summary { list-style: none; }
summary::-webkit-details-marker { display: none; }
.list { position: absolute; z-index: 5; right: 0; top: 28px; background: var(--al-panel); padding: 6px 4px;
  border: 1px solid var(--al-border); border-radius: 6px; box-shadow: 0 6px 24px rgba(0, 0, 0, 0.35); }
.list label { display: flex; gap: 8px; align-items: center; padding: 3px 10px 3px 6px; border-radius: 4px; cursor: pointer; }
.list label:hover { background: var(--al-body); }
.list input { accent-color: var(--al-accent); margin: 0; }
.corner { position: absolute; width: 17px; height: 17px; padding: 0; border: 0; background: none; line-height: 16px;
  color: var(--al-dim); font-size: 13px; }
.corner:hover { color: var(--al-text); }
`;

export class Toolbar {
  constructor(scopes) {
    this.scopes = scopes;
    this.style = document.createElement("style");
    this.style.textContent = STYLE;
    this.root = make("div", { className: "bar", role: "toolbar", ariaLabel: "scopes" });
    const { root } = this;
    this.pause = make("button", { className: "pause", title: "pause the display, not the bench (space)" });
    this.pause.onclick = () => scopes.time.toggle();
    const closer = make("button", { className: "square", textContent: "+", title: "shorter window (+, wheel)", ariaLabel: "shorter window" });
    const wider = make("button", { className: "square", textContent: "−", title: "longer window (−, wheel)", ariaLabel: "longer window" });
    closer.onclick = () => scopes.time.step(-1);
    wider.onclick = () => scopes.time.step(1);
    this.span = make("select", { title: "window", ariaLabel: "window" });
    this.own = make("option", { value: "own", hidden: true });
    this.span.append(this.own, ...WINDOWS.map((w) => make("option", { value: String(w), textContent: duration(w) })));
    this.span.onchange = () => {
      scopes.time.zoom(Number(this.span.value), scopes.time.right);
      this.span.blur();
    };
    this.told = make("div", { className: "told" });
    this.clear = make("button", { textContent: "Clear", title: "remove cursors, all scales automatic (c)" });
    this.clear.onclick = () => scopes.gestures.clear();
    this.menu = document.createElement("details");
    this.entries = make("div", { className: "list" });
    this.menu.append(make("summary", { textContent: "Scopes ▾", title: "which scopes are shown" }), this.entries);
    root.append(this.pause, wider, this.span, closer, this.told, this.clear, this.menu);
    this.corners = new Map();
    // A button that was clicked gives the keys back: the next space pauses.
    scopes.shadowRoot.addEventListener("click", (event) => {
      if (event.detail && event.target.matches("button")) event.target.blur();
    });
    document.addEventListener("pointerdown", (event) => {
      if (!event.composedPath().includes(this.menu)) this.menu.open = false;
    });
  }

  /** The entries of the menu, once it is known which scopes there are. */
  list() {
    const { scopes } = this;
    for (const pair of this.corners.values()) for (const button of pair) button.remove();
    this.corners.clear();
    this.entries.replaceChildren(
      ...scopes.strips.map(({ spec }) => {
        const box = make("input", { type: "checkbox", checked: !scopes.hidden_.has(spec.id) });
        box.onchange = () => scopes.display(spec.id, box.checked);
        const label = document.createElement("label");
        label.append(box, spec.title);
        return label;
      }),
    );
  }

  /** Say what is the case; writes only what has changed. */
  refresh() {
    const { time, bench, enlarged } = this.scopes;
    const held = time.paused;
    set(this.pause, "textContent", held ? "▶ Live" : "❚❚ Pause");
    if (this.pause.classList.contains("held") !== held) this.pause.classList.toggle("held", held);
    const round = WINDOWS.find((w) => Math.abs(w / time.span - 1) < 1e-3);
    if (!round) set(this.own, "textContent", this.scopes.spanText());
    set(this.span, "value", round ? String(round) : "own");
    const silent = bench.silent > 1 ? `no telemetry for ${Math.floor(bench.silent)} s` : "";
    const problem = bench.connected ? silent : bench.problem;
    set(this.told, "textContent", [problem, this.scopes.cursorText()].filter(Boolean).join("   "));
    set(this.told, "className", problem ? "told problem" : "told");
    const busy = time.cursors[0] !== null || this.scopes.strips.some((s) => s.manual);
    set(this.clear, "hidden", !busy);
    set(this.menu, "hidden", Boolean(enlarged));
  }

  /** A button at the corner of each scope: enlarge, and log or linear where that is a choice. */
  buttons(placed) {
    for (const [id, pair] of this.corners) {
      if (!placed.some(({ strip }) => strip.spec.id === id)) for (const button of pair) button.hidden = true;
    }
    for (const { strip, box } of placed) {
      const { id, title, scale } = strip.spec;
      if (!this.corners.has(id)) this.corners.set(id, this._corner(strip, id, title, scale));
      const large = this.scopes.enlarged === id;
      const [enlarge, kind] = this.corners.get(id);
      place(enlarge, box.x + box.w - 21, box.y + 35);
      set(enlarge, "textContent", large ? "✕" : "⤢");
      if (kind) {
        place(kind, box.x + 50, box.y + 56);
        set(kind, "textContent", strip.log ? "log" : "lin");
      }
    }
  }

  _corner(strip, id, title, scale) {
    const enlarge = make("button", { className: "corner", title: `enlarge, or back (double click on “${title}”)`, ariaLabel: `enlarge ${title}` });
    enlarge.onclick = () => this.scopes.enlarge(id);
    const made = [enlarge];
    if (scale) {
      const kind = make("button", { className: "corner", title: "logarithmic or linear scale", ariaLabel: "kind of scale" });
      kind.style.cssText = "width:24px;font-size:11px";
      kind.onclick = () => {
        strip.log = !strip.log;
        strip.manual = null;
        this.scopes.painter.want();
      };
      made.push(kind);
    }
    this.scopes.shadowRoot.append(...made);
    return made;
  }
}

function make(tag, properties) {
  return Object.assign(document.createElement(tag), properties);
}

function set(node, name, value) {
  if (node[name] !== value) node[name] = value;
}

function place(node, x, y) {
  const left = `${Math.round(x)}px`, top = `${Math.round(y)}px`;
  node.hidden = false;
  if (node.style.left !== left) node.style.left = left;
  if (node.style.top !== top) node.style.top = top;
}
