// Pieces of the interface.

const ICONS = {
  play: "M4 2.5v11l9.5-5.5z",
  pause: "M3.5 2.5h3.2v11H3.5zM9.3 2.5h3.2v11H9.3z",
};

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

function drawing(tag, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

const icon = (name) => drawing("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, drawing("path", { d: ICONS[name] }));

// A button that stays down; changed(pressed) is called when it is used.
function toggle(text, title, pressed, changed) {
  const button = element("button", { type: "button", class: "mv-button", title, "aria-pressed": pressed }, text);
  button.addEventListener("click", () => {
    const now = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", now);
    changed(now);
  });
  return button;
}

// One of several; choices: {value: text}.
function choice(label, choices, chosen, changed) {
  const buttons = Object.entries(choices).map(([value, text]) =>
    element("button", { type: "button", class: "mv-button", "data-value": value, "aria-pressed": value === chosen,
      onclick: () => {
        for (const button of buttons) button.setAttribute("aria-pressed", button.dataset.value === value);
        changed(value);
      } }, text),
  );
  return element("span", { class: "mv-choice", role: "group", "aria-label": label }, ...buttons);
}

function select(label, options, chosen, changed) {
  const made = element("select", { class: "mv-select", "aria-label": label, onchange: () => changed(made.value) });
  for (const [value, text] of options) made.append(element("option", { value }, text));
  made.value = chosen;
  return made;
}

// A number in three digits, without exponent where it can be.
function short(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-3 || size >= 1e6) return value.toExponential(2);
  return size >= 100 ? value.toFixed(0) : value.toFixed(size >= 10 ? 1 : size >= 1 ? 2 : 3);
}

// Equal steps of 1, 2 or 5 times a power of ten, from 0 to at most `high`, at most 5/4 `count` of them.
function ticks(high, count) {
  const rough = high / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= 0.8 * rough);
  return Array.from({ length: Math.floor(high / step + 1e-9) + 1 }, (_, i) => Number((i * step).toPrecision(6)));
}

// The bar from 0 to `high`, whose upper end can be typed.
class ColourBar {
  constructor(stops, changed) {
    const colours = stops.map((stop) => `rgb(${stop.map((part) => Math.round(255 * part)).join(" ")})`);
    this.marks = element("div", { class: "mv-ticks", "aria-hidden": "true" });
    const ramp = element("div", { class: "mv-ramp", style: `background: linear-gradient(to right, ${colours})` });
    this.input = element("input", { type: "number", class: "mv-number", min: "0", step: "any",
      "aria-label": "value of the brightest colour" });
    this.input.addEventListener("change", () => {
      const value = Number(this.input.value);
      if (value > 0 && Number.isFinite(value)) changed(value);
      else this.input.value = this.high;
    });
    this.unit = element("span");
    const end = element("label", { class: "mv-range", title: "value of the brightest colour" }, "up to ", this.input, " ",
      this.unit);
    this.root = element("div", { class: "mv-bar" }, element("div", { class: "mv-scale" }, ramp, this.marks), end);
  }

  show(high, unit) {
    this.high = Number(high.toPrecision(3));
    this.input.value = this.high;
    this.unit.textContent = unit;
    this.root.setAttribute("aria-label", `colours from 0 to ${short(high)} ${unit}`);
    this.marks.replaceChildren(
      ...ticks(high, 5).map((value) =>
        element("span", { style: `left: ${(100 * value) / high}%` }, value === 0 ? "0" : String(value)),
      ),
    );
  }
}
