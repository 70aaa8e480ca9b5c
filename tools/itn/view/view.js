"use strict";
// The page of `itn view`. Asks for frames as long as it is seen, sends what sliders say, one request at a time.

const element = (id) => document.getElementById(id);
const make = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};

let about = null;      // the answer of /parameters
let rows = [];         // one a parameter: {parameter, slider, field, mark, to, fit}
let frame = null;      // the last one's numbers
let look = 0;          // of the photo that is shown
let touched = "";      // the name of the parameter that was moved last
let revision = 0;      // of what was set last
let pending = {};      // values to send
let sending = false;
let taken = 0;         // the revision from which the last step was taken
const pictures = {};   // bytes by name

// ---- numbers ----

function text(value, digits = 5) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  return size > 0 && size < 1e-3 ? value.toExponential(Math.min(digits, 3) - 1) : String(Number(value.toPrecision(digits)));
}
const number = (value) => String(Number(value.toPrecision(7)));
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

// A slider's value at a place from 0 to 1 (runtime/view/slider.h), and back.
function valueAt({ scale, low, high }, t) {
  if (scale === "logarithm") return low * (high / low) ** t;
  if (scale === "from_low") return low + (high - low) * t ** 3;
  if (scale === "to_high") return high - (high - low) * (1 - t) ** 3;
  return low + (high - low) * t;
}

function placeOf({ scale, low, high }, value) {
  const share = clamp((value - low) / (high - low), 0, 1);
  if (scale === "logarithm") return clamp(Math.log(value / low) / Math.log(high / low), 0, 1);
  if (scale === "from_low") return Math.cbrt(share);
  if (scale === "to_high") return 1 - Math.cbrt(1 - share);
  return share;
}

// ---- requests ----

const complaints = {};  // by what they are about

function say(topic, complaint) {
  complaints[topic] = complaint;
  const message = Object.values(complaints).filter(Boolean).join(" ");
  if (element("message").textContent !== message) element("message").textContent = message;
  element("message").hidden = !message;
}

async function post(path, body) {
  const answer = await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });
  const result = await answer.json();
  if (!answer.ok) throw new Error(result.error);
  return result;
}

async function tell(path, body) {
  try {
    const result = await post(path, body);
    say(path, "");
    return result;
  } catch (error) {
    // Without a connection watch() says so.
    say(path, error instanceof TypeError ? "" : error.message);
    return null;
  }
}

async function send() {
  if (sending) return;
  sending = true;
  while (Object.keys(pending).length > 0) {
    const values = pending;
    pending = {};
    const result = await tell("set", values);
    if (result) revision = Math.max(revision, result.revision);
    else if (frame) show(frame.values, true);  // what was refused goes back
  }
  sending = false;
}

function move(row, value) {
  pending[row.parameter.name] = value;
  if (touched !== row.parameter.name) touch(row.parameter.name);
  send();
}

function touch(name) {
  touched = name;
  element("touched").textContent = name;
  if (element("overlay").checked) tell("look", { derivative: name });
}

// ---- parameters ----

function showValue(row, value) {
  const { slider } = row.parameter;
  row.slider.value = placeOf(slider, value);
  row.slider.setAttribute("aria-valuetext", `${text(value)} ${row.parameter.unit}`);
  row.field.value = number(value);
}

// Not over what somebody is typing, unless `all`.
function show(values, all = false) {
  for (const row of rows) {
    const value = values[row.index];
    if (value !== null && (all || document.activeElement !== row.field)) showValue(row, value);
  }
}

function rowOf(parameter, index) {
  const id = `p${index}`;
  const row = { parameter, index };
  const name = make("label", { htmlFor: id, textContent: parameter.label });
  const unit = parameter.unit && parameter.unit !== "1" ? ` ${parameter.unit}` : "";
  const range = make("span", { className: "about", textContent: `${parameter.range}${unit}` });
  const box = make("div", { className: "parameter" });
  if (parameter.value === null) {
    box.append(make("span", { textContent: parameter.label }), range,
      make("span", { className: "about note", textContent: "a texture or a grid" }));
    return [box, null];
  }
  row.slider = make("input", { type: "range", id, min: 0, max: 1, step: "any" });
  row.field = make("input", { type: "number", step: "any" });
  row.field.setAttribute("aria-label", parameter.name);
  row.mark = make("span", { className: "mark", hidden: true });
  row.to = make("span", { className: "to" });
  const nameBox = make("span", { className: "name" }, name, range);
  box.append(nameBox, row.field);
  const below = make("span", { className: "below" }, row.to);
  box.append(make("span", { className: "track" }, row.slider, row.mark), below);
  if (about.target && !parameter.not_differentiable) {
    row.fit = make("input", { type: "checkbox" });
    row.fit.addEventListener("change", sendFit);
    below.prepend(make("label", { className: "check" }, row.fit, "fit"));
  }
  if (parameter.not_differentiable)
    box.append(make("span", { className: "about note", textContent: `no derivative: ${parameter.not_differentiable}` }));
  row.slider.addEventListener("input", () => {
    const value = clamp(valueAt(parameter.slider, Number(row.slider.value)), parameter.low ?? -Infinity, parameter.high ?? Infinity);
    row.field.value = number(value);
    row.slider.setAttribute("aria-valuetext", `${text(value)} ${parameter.unit}`);
    move(row, Number(row.field.value));
  });
  // Arrow keys move by a hundredth of the slider, with Shift by a thousandth.
  row.slider.addEventListener("keydown", (event) => {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
    if (!way) return;
    event.preventDefault();
    row.slider.value = Number(row.slider.value) + way * (event.shiftKey ? 0.001 : 0.01);
    row.slider.dispatchEvent(new Event("input"));
  });
  row.slider.addEventListener("focus", () => touch(parameter.name));
  row.field.addEventListener("change", () => {
    const value = Number(row.field.value);
    if (row.field.value === "" || !Number.isFinite(value)) return show(frame ? frame.values : about.parameters.map((p) => p.value), true);
    showValue(row, value);
    move(row, value);
  });
  return [box, row];
}

function build() {
  document.title = `${about.scene} – itn view`;
  element("scene").textContent = about.scene;
  document.body.classList.toggle("with-target", about.target);
  document.documentElement.style.setProperty("--aspect", about.width / about.height);
  for (const part of document.querySelectorAll(".of-target")) part.hidden = !about.target;
  for (const id of ["image", "photo", "residual"]) {
    element(id).width = about.width;
    element(id).height = about.height;
  }
  let group = null;
  about.parameters.forEach((parameter, index) => {
    if (!group || group.dataset.id !== parameter.id) {
      group = make("fieldset", {}, make("legend", { textContent: parameter.id }));
      group.dataset.id = parameter.id;
      element("parameters").append(group);
    }
    const [box, row] = rowOf(parameter, index);
    group.append(box);
    if (row) rows.push(row);
  });
  show(about.parameters.map((p) => p.value));
}

function sendFit() {
  tell("look", { fit: rows.filter((row) => row.fit && row.fit.checked).map((row) => row.parameter.name) });
}

// ---- pictures ----

function paint(canvas, bytes, over) {
  const context = canvas.getContext("2d");
  const data = context.createImageData(canvas.width, canvas.height);
  for (let i = 0, from = 0; i < data.data.length; i += 4, from += 3) {
    let r = bytes[from], g = bytes[from + 1], b = bytes[from + 2];
    if (over) {
      // Grey below; red or blue as strong as the derivative is, of which the picture says white for none.
      const grey = 0.3 * r + 0.59 * g + 0.11 * b;
      const strong = 1 - over[from + 1] / 255, red = over[from] >= over[from + 2];
      r = grey * (1 - strong) + (red ? 255 : 0) * strong;
      g = grey * (1 - strong);
      b = grey * (1 - strong) + (red ? 0 : 255) * strong;
    }
    data.data.set([r, g, b, 255], i);
  }
  context.putImageData(data, 0, 0);
}

function paintAll() {
  if (!pictures.image) return;
  const over = element("overlay").checked && frame.derivative ? pictures.derivative : null;
  paint(element("image"), pictures.image, over);
  element("image").dataset.revision = frame.revision;
  element("image").dataset.spp = frame.spp;
  if (pictures.photo) paint(element("photo"), pictures.photo);
  if (pictures.residual) paint(element("residual"), pictures.residual);
}

function scaleText(place, scale, unit) {
  place.replaceChildren(
    make("span", { className: "blue", textContent: `blue −${text(scale, 3)}` }), ", ",
    make("span", { className: "red", textContent: `red +${text(scale, 3)}` }), unit);
}

function describe() {
  if (frame.spp === 0) {
    element("status").textContent = "Loading and compiling: the first time takes seconds, later times do not";
    return;
  }
  element("status").textContent = `${about.width} × ${about.height}, ${frame.spp} of ${about.spp} samples a pixel${frame.done ? ", finished" : ""}`;
  element("noise").textContent = frame.noise === null ? "" : `noise ${text(100 * frame.noise, 2)} %`;
  const place = element("derivative");
  if (!element("overlay").checked) {
    place.textContent = "";
  } else if (frame.derivative) {
    const unit = about.parameters.find((p) => p.name === frame.derivative.parameter).unit;
    scaleText(place, frame.derivative.scale, ` radiance for each ${unit && unit !== "1" ? unit : "unit"} of ${frame.derivative.parameter}, mean of 3 × 3 pixels less its noise`);
  } else {
    place.textContent = touched ? `${touched}: ${frame.derivative_note || "a moment"}` : "Touch a parameter.";
  }
  if (about.target) describeFit();
}

function describeFit() {
  if (frame.residual_scale !== undefined) scaleText(element("residual-scale"), frame.residual_scale, "");
  const { loss, step } = frame;
  if (loss) {
    const exposure = loss.exposure === undefined ? "" : `, exposure ${text(loss.exposure, 4)}`;
    element("loss").textContent = `Mean squared difference ${text(loss.value, 4)} ± ${text(loss.stderr, 2)}${exposure}`;
  }
  for (const row of rows) {
    if (row.fit && document.activeElement !== row.fit) row.fit.checked = frame.fit.includes(row.parameter.name);
    const change = step && step.values[row.parameter.name];
    row.mark.hidden = !change;
    row.to.textContent = change ? `→ ${text(change.to, 4)}` : "";
    row.to.title = change ? "where Gauss-Newton would step" : "";
    if (change) {
      const t = placeOf(row.parameter.slider, change.to);
      row.mark.style.left = `calc(${t} * (100% - 16px) + 8px)`;
    }
  }
  element("step").disabled = !step;
  let note = frame.step_note;
  if (!note && step) {
    note = `The step is ${text(step.distance, 2)} standard errors long`;
    if (!step.settled) note += "; more samples will tell.";
    else if (step.misfit) note += `: there are no better values near these, but this is NOT a fit: ${step.misfit}`;
    else note += step.distance < 0.4 ? ": these are the best values that this photo can tell." : ".";
  } else if (!note) {
    note = frame.fit.length === 0 ? "Tick the parameters to fit." : "It waits for a quieter image.";
  }
  element("step-note").textContent = note;
  if (step && element("keep").checked && taken !== frame.revision && step.settled && step.distance >= 0.4) takeStep();
}

async function takeStep() {
  taken = frame.revision;
  await tell("step", {});
}

function receive(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const next = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const size = 3 * about.width * about.height;
  delete pictures.derivative;
  next.pictures.forEach((name, k) => { pictures[name] = new Uint8Array(buffer, 4 + length + k * size, size); });
  const isNew = !frame || next.number !== frame.number || next.look !== look;
  frame = next;
  look = next.look;
  if (!isNew) return;
  say("values", frame.problem);
  paintAll();
  describe();
  // Values that another tab, or a step, has set.
  if (!sending && Object.keys(pending).length === 0 && frame.revision >= revision && frame.spp > 0) show(frame.values);
  if (document.activeElement !== element("exposure")) showStops(frame.exposure);
}

function showStops(stops) {
  element("exposure").value = stops;
  element("stops").textContent = `${stops > 0 ? "+" : ""}${text(stops, 2)} stops`;
}

const seen = () => new Promise((resolve) => {
  if (!document.hidden) resolve();
  else document.addEventListener("visibilitychange", () => resolve(), { once: true });
});
const pause = (milliseconds) => new Promise((resolve) => { setTimeout(resolve, milliseconds); });

async function watch() {
  let lost = false;
  for (;;) {
    await seen();
    try {
      const answer = await fetch(`frame?after=${frame ? frame.number : 0}&look=${look}`);
      if (!answer.ok) throw new Error("the server has another token: open the address that it has printed");
      receive(await answer.arrayBuffer());
      if (lost) say("connection", "");
      lost = false;
    } catch (error) {
      lost = true;
      say("connection", error instanceof TypeError ? "No connection: itn view has ended, or does not answer." : error.message);
      element("status").textContent = "Not connected";
      await pause(1000);
    }
  }
}

// ---- the rest ----

async function save(file) {
  try {
    const answer = await fetch(file);
    if (!answer.ok) throw new Error((await answer.json()).error);
    const name = /filename="([^"]*)"/.exec(answer.headers.get("Content-Disposition"))[1];
    const link = make("a", { href: URL.createObjectURL(await answer.blob()), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    say("save", "");
  } catch (error) {
    say("save", `${file}: ${error.message}`);
  }
}

async function start() {
  for (;;) {
    try {
      const answer = await fetch("parameters");
      if (!answer.ok) throw new Error();
      about = await answer.json();
      break;
    } catch {
      say("connection", "No connection: itn view has ended, or the token is wrong.");
      await pause(1000);
    }
  }
  say("connection", "");
  build();
  for (const button of document.querySelectorAll("[data-file]")) button.addEventListener("click", () => save(button.dataset.file));
  element("overlay").addEventListener("change", () => {
    tell("look", { derivative: element("overlay").checked ? touched : "" });
    if (frame) { paintAll(); describe(); }
  });
  element("exposure").addEventListener("input", () => {
    showStops(Number(element("exposure").value));
    tell("look", { exposure: Number(element("exposure").value) });
  });
  element("automatic").addEventListener("click", () => tell("look", { exposure: "automatic" }));
  element("step").addEventListener("click", takeStep);
  element("keep").addEventListener("change", () => { if (frame) describe(); });
  element("reset").addEventListener("click", () => {
    for (const row of rows) pending[row.parameter.name] = row.parameter.value;
    show(about.parameters.map((p) => p.value));
    send();
  });
  watch();
}

start();
