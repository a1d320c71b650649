// The bench's display: defines its elements.

import { bench } from "./connection.js";
import { Plan } from "./plan.js";
import { Scopes } from "./scopes.js";
import { timeline } from "./timeline.js";

customElements.define("alight-plan", Plan);
customElements.define("alight-scopes", Scopes);

// For the page around it, and for a look from the browser's console.
globalThis.alight = { bench: bench(), timeline: timeline() };
