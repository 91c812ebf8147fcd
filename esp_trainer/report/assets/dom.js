// Elements of the page.

const byId = (id) => document.getElementById(id);

// Return a new element with properties and children.
function element(tag, properties = {}, children = []) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// Return a new button that calls a function.
function buttonOf(text, press, properties = {}) {
  const made = element("button", { type: "button", textContent: text, ...properties });
  made.addEventListener("click", press);
  return made;
}

// Set the options of a select, [[value, text, disabled], ...]. It is hidden if there is nothing to choose.
function fill(select, options) {
  select.replaceChildren(...options.map(([value, textContent, disabled]) => element("option", { value, textContent, disabled: Boolean(disabled) })));
  select.hidden = options.length < 2;
}

// Return a number and its noun: "1 step", "2 steps".
const counted = (n, noun) => `${n} ${noun}${n === 1 ? "" : "s"}`;

// Return whether the reader asked for little motion.
const calm = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

// Scroll an element to the top of the window.
const bring = (place) => place.scrollIntoView({ behavior: calm() ? "auto" : "smooth", block: "start" });
