// One number of the panel: symbol, slider, field, unit, and the value in force beside the draft.
// It keeps what is being typed to itself until the server says otherwise with a new revision.

const STEPS = 1000;

class Field extends HTMLElement {
  static observedAttributes = ["now", "draft", "revision", "problem", "locked"];

  connectedCallback() {
    if (this._input) return;
    const [symbol, index] = [this.getAttribute("symbol"), this.getAttribute("index") || ""];
    const name = document.createElement("label");
    name.textContent = index ? `${symbol}[${index}]` : symbol;
    this._slider = Object.assign(document.createElement("input"), {
      type: "range", min: 0, max: STEPS, step: 1, tabIndex: 0,
    });
    this._input = Object.assign(document.createElement("input"), {
      type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false,
    });
    const label = name.textContent;
    this._slider.setAttribute("aria-label", `${label}, slider`);
    this._input.setAttribute("aria-label", label);
    const unit = document.createElement("span");
    unit.className = "unit";
    unit.textContent = this.getAttribute("unit") || "";
    this._note = document.createElement("div");
    this._note.className = "note";
    this._mark = document.createElement("span");
    this._mark.className = "mark";
    this.title = this.getAttribute("meaning") || "";
    const rail = document.createElement("span");
    rail.className = "rail";
    rail.append(this._slider, this._mark);
    this.append(name, rail, this._input, unit, this._note);
    this._slider.addEventListener("input", () => {
      this._input.value = tidy(this._valueAt(this._slider.value / STEPS));
      this._tell();
    });
    this._slider.addEventListener("dblclick", () => this._back());
    this._input.addEventListener("input", () => {
      this._place();
      this._tell();
    });
    this._input.addEventListener("keydown", (event) => this._key(event));
    this._input.addEventListener("focus", () => this._input.select());
    this._show();
  }

  attributeChangedCallback(name, before, after) {
    if (!this._input || before === after) return;
    if (name === "revision" || name === "now" || name === "locked") this._show();
    else this._remark();
  }

  _text() {
    return this.getAttribute("draft") || this.getAttribute("now") || "";
  }

  _show() {
    const locked = this.getAttribute("locked") === "yes";
    this._input.disabled = this._slider.disabled = locked;
    if (this.getAttribute("revision") !== this._revision || !this._typed) {
      this._revision = this.getAttribute("revision");
      this._input.value = this._text();
      this._typed = false;
    }
    this._place();
    this._remark();
  }

  _remark() {
    const problem = this.getAttribute("problem") || "";
    const now = this.getAttribute("now") || "";
    const differs = this._input.value.trim() !== "" && Number(this._input.value) !== Number(now);
    this.classList.toggle("bad", problem !== "");
    this.classList.toggle("changed", differs);
    this._note.textContent = problem || (differs ? `in force ${now}` : "");
    this._input.setAttribute("aria-invalid", problem !== "");
  }

  _place() {
    const value = Number(String(this._input.value).replace(",", "."));
    if (Number.isFinite(value)) this._slider.value = STEPS * this._shareOf(value);
    const now = this._shareOf(Number(this.getAttribute("now")));
    this._mark.style.left = `${100 * (0.02 + 0.96 * now)}%`;
  }

  _ends() {
    return [Number(this.getAttribute("from")), Number(this.getAttribute("to"))];
  }

  _valueAt(share) {
    const [from, to] = this._ends();
    if (this.getAttribute("scale") === "log") return from * (to / from) ** share;
    return from + (to - from) * share;
  }

  _shareOf(value) {
    const [from, to] = this._ends();
    const log = this.getAttribute("scale") === "log";
    const share = log ? Math.log(value / from) / Math.log(to / from) : (value - from) / (to - from);
    return Math.min(1, Math.max(0, Number.isFinite(share) ? share : 0));
  }

  _key(event) {
    event.stopPropagation();
    if (event.key === "Enter") this.dispatchEvent(new CustomEvent("enter"));
    if (event.key !== "ArrowUp" && event.key !== "ArrowDown") {
      if (event.key === "Escape") document.dispatchEvent(new KeyboardEvent("keydown", event));
      return;
    }
    event.preventDefault();
    const step = (event.key === "ArrowUp" ? 1 : -1) * (event.shiftKey ? 20 : 4) / STEPS;
    const value = Number(this._input.value);
    this._input.value = tidy(this._valueAt(Math.min(1, Math.max(0, this._shareOf(value) + step))));
    this._place();
    this._tell();
  }

  _back() {
    this._input.value = this.getAttribute("now");
    this._place();
    this._tell();
  }

  _tell() {
    this._typed = true;
    this._remark();
    this.dispatchEvent(new CustomEvent("draft", { detail: this._input.value }));
  }
}

function tidy(value) {
  return String(Number(value.toPrecision(3)));
}

if (!customElements.get("alight-field")) customElements.define("alight-field", Field);

// Where a recording stands: follows it, but not against the hand that drags it.

class Seek extends HTMLElement {
  static observedAttributes = ["at", "rows", "first"];

  connectedCallback() {
    if (this._slider) return;
    this._slider = Object.assign(document.createElement("input"), { type: "range", step: 1 });
    this._slider.setAttribute("aria-label", "position in the recording");
    this._end = document.createElement("span");
    this.append(this._slider, this._end);
    this._slider.addEventListener("pointerdown", () => (this._held = true));
    addEventListener("pointerup", () => (this._held = false));
    this._slider.addEventListener("input", () => {
      this.dispatchEvent(new CustomEvent("seek", { detail: Number(this._slider.value) }));
    });
    this.attributeChangedCallback();
  }

  attributeChangedCallback() {
    if (!this._slider) return;
    this._slider.min = this.getAttribute("first");
    this._slider.max = this.getAttribute("rows");
    if (!this._held) this._slider.value = this.getAttribute("at");
    const rows = Number(this.getAttribute("rows"));
    this._end.textContent = `${(rows * Number(this.getAttribute("dt"))).toFixed(2)} s`;
  }
}

if (!customElements.get("alight-seek")) customElements.define("alight-seek", Seek);

// Light or dark: as chosen the last time in this browser, dark at first.

const root = document.documentElement;

function themed(name) {
  root.dataset.theme = name;
  window.Quasar?.Dark?.set(name === "dark");
  try {
    localStorage.setItem("alight-theme", name);
  } catch {
    // It is for this visit, then.
  }
}

let chosen = "dark";
try {
  chosen = localStorage.getItem("alight-theme") || "dark";
} catch {
  // Without storage it is dark.
}
root.dataset.theme = chosen;
window.alightTheme = () => themed(root.dataset.theme === "light" ? "dark" : "light");

// Escape stops, wherever the focus is.

document.addEventListener("keydown", (event) => {
  if (event.key === "Escape" && !event.repeat) document.querySelector("#stop")?.click();
});
