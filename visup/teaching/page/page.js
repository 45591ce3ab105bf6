// Outlines are drawn over one frame of the clip, in the frame's own pixels, and posted to the server.
"use strict";

const $ = (id) => document.getElementById(id);
const canvas = $("picture");
const paper = canvas.getContext("2d");
const COLOURS = ["#ffb43c", "#4cc9f0", "#b8e986", "#ff8fab", "#c8a2ff", "#ffe066"];
const GRAB = 9; // screen pixels from a corner within which it is meant

const state = {
  count: null, frame: 0, target: 0, image: null, known: {},
  things: [], chosen: null, // {name, frame, corners, stored}
  draft: [], cross: null, pointer: null,
  zoom: 1, left: 0, top: 0, // picture pixel (x, y) is drawn at (left + zoom x, top + zoom y)
  moving: null, dragged: null, leaving: false,
};

// ---- talking to the server

async function ask(what, given) {
  const answer = await fetch(what, given === undefined ? {} : {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(given),
  });
  const reply = await answer.json().catch(() => ({ error: `the server said ${answer.status}` }));
  if (reply.error) throw new Error(reply.error);
  return reply;
}

function tell(text, kind = "") {
  $("status").textContent = text;
  $("status").className = kind;
}

// ---- frames

let wanted = 0;
function show(number) {
  const last = state.count === null ? Infinity : Math.max(0, state.count - 1);
  number = Math.min(last, Math.max(0, Math.round(number) || 0));
  const request = ++wanted;
  state.target = number;
  const image = new Image();
  image.onload = () => {
    if (request !== wanted) return;
    const first = state.image === null;
    state.frame = number;
    state.image = image;
    if (state.cross === null) state.cross = [image.naturalWidth / 2, image.naturalHeight / 2];
    $("slider").value = $("frame").value = number;
    canvas.dataset.frame = number;
    if (first) fit();
    draw();
  };
  image.onerror = () => {
    if (request !== wanted) return;
    state.target = state.frame;
    tell(`There is no frame ${number}.`, "bad");
  };
  image.src = `frame/${number}`;
}

// ---- zooming

function resize() {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  paper.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw();
}

function fit() {
  if (!state.image) return;
  const { naturalWidth: w, naturalHeight: h } = state.image;
  state.zoom = Math.min(canvas.clientWidth / w, canvas.clientHeight / h, 8);
  state.left = (canvas.clientWidth - state.zoom * w) / 2;
  state.top = (canvas.clientHeight - state.zoom * h) / 2;
  draw();
}

function zoomBy(factor, at = [canvas.clientWidth / 2, canvas.clientHeight / 2]) {
  const zoom = Math.min(24, Math.max(0.05, state.zoom * factor));
  const [x, y] = toPicture(at);
  state.zoom = zoom;
  state.left = at[0] - zoom * x;
  state.top = at[1] - zoom * y;
  draw();
}

const toPicture = ([a, b]) => [(a - state.left) / state.zoom, (b - state.top) / state.zoom];
const toScreen = ([x, y]) => [state.left + state.zoom * x, state.top + state.zoom * y];
const place = (event) => [event.offsetX, event.offsetY];

function inside([x, y]) {
  const { naturalWidth: w, naturalHeight: h } = state.image;
  const round = (n, most) => Math.round(Math.min(most, Math.max(0, n)) * 10) / 10;
  return [round(x, w - 1), round(y, h - 1)];
}

// ---- drawing

function draw() {
  paper.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  $("zoom").textContent = `${Math.round(100 * state.zoom)} %`;
  $("spot").textContent = state.pointer ? `(${state.pointer.map(Math.round).join(", ")})` : "";
  if (!state.image) return;
  paper.imageSmoothingEnabled = state.zoom < 3; // close by, pixels are to be seen
  const { naturalWidth: w, naturalHeight: h } = state.image;
  paper.drawImage(state.image, state.left, state.top, state.zoom * w, state.zoom * h);
  state.things.forEach((thing, k) => {
    if (thing.frame === state.frame) drawThing(thing, COLOURS[k % COLOURS.length]);
  });
  if (state.draft.length) {
    const ahead = state.pointer ? [...state.draft, state.pointer] : state.draft;
    stroke(ahead, COLOURS[state.things.length % COLOURS.length], false);
    corners(state.draft, "#ffffff");
  }
  if (document.activeElement === canvas && state.cross) drawCross(toScreen(state.cross));
}

function path(points, closed) {
  paper.beginPath();
  points.map(toScreen).forEach(([x, y], k) => (k ? paper.lineTo(x, y) : paper.moveTo(x, y)));
  if (closed) paper.closePath();
}

function stroke(points, colour, closed) {
  for (const [width, shade] of [[4, "rgb(0 0 0 / 65%)"], [2, colour]]) {
    path(points, closed);
    paper.lineWidth = width;
    paper.strokeStyle = shade;
    paper.stroke();
  }
}

function corners(points, colour) {
  for (const [x, y] of points.map(toScreen)) {
    paper.fillStyle = "#000000";
    paper.fillRect(x - 4, y - 4, 8, 8);
    paper.fillStyle = colour;
    paper.fillRect(x - 3, y - 3, 6, 6);
  }
}

function drawThing(thing, colour) {
  path(thing.corners, true);
  paper.fillStyle = `${colour}33`;
  paper.fill();
  stroke(thing.corners, colour, true);
  if (thing === state.chosen) corners(thing.corners, colour);
  const [x, y] = toScreen(thing.corners.reduce((a, b) => (b[1] < a[1] ? b : a)));
  paper.font = "600 13px system-ui, sans-serif";
  const wide = paper.measureText(thing.name || "?").width;
  paper.fillStyle = "rgb(0 0 0 / 70%)";
  paper.fillRect(x - 4, y - 24, wide + 8, 19);
  paper.fillStyle = colour;
  paper.fillText(thing.name || "?", x, y - 10);
}

function drawCross([x, y]) {
  for (const [width, shade] of [[3, "rgb(0 0 0 / 70%)"], [1, "#ffffff"]]) {
    paper.lineWidth = width;
    paper.strokeStyle = shade;
    paper.beginPath();
    for (const [a, b] of [[-12, -3], [3, 12]]) {
      paper.moveTo(x + a, y); paper.lineTo(x + b, y);
      paper.moveTo(x, y + a); paper.lineTo(x, y + b);
    }
    paper.stroke();
  }
}

// ---- outlines

function putCorner(point) {
  state.chosen = null;
  state.draft.push(inside(point));
  state.cross = inside(point);
  list();
}

function closeOutline() {
  const points = state.draft.filter((p, k) => !k || distance(p, state.draft[k - 1]) * state.zoom > 2);
  if (points.length < 3) {
    if (state.draft.length) tell("An outline has at least three corners.", "bad");
    return;
  }
  const name = $("name").value.trim();
  const thing = { name, frame: state.frame, corners: points, stored: false };
  state.things.push(thing);
  state.draft = [];
  state.chosen = thing;
  $("name").value = "";
  state.leaving = false;
  tell("");
  list();
  if (!name) fieldOf(thing).focus();
}

function remove(thing) {
  state.things = state.things.filter((t) => t !== thing);
  if (state.chosen === thing) state.chosen = null;
  list();
}

function changed(thing) {
  thing.stored = false;
  list();
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

function cornerAt(at) {
  const near = (p) => distance(toScreen(p), at) <= GRAB;
  const thing = [state.chosen, ...state.things].find(
    (t) => t && t.frame === state.frame && t.corners.some(near));
  return thing ? { thing, k: thing.corners.findIndex(near) } : null;
}

// ---- the list

const fieldOf = (thing) => $("things").children[state.things.indexOf(thing)].querySelector("input");

function list() {
  const items = $("things");
  while (items.children.length > state.things.length) items.lastChild.remove();
  state.things.forEach((thing, k) => {
    const item = items.children[k] || items.appendChild(newItem());
    const [xs, ys] = [0, 1].map((n) => thing.corners.map((p) => p[n]));
    const size = [xs, ys].map((n) => Math.round(Math.max(...n) - Math.min(...n))).join(" × ");
    const field = item.querySelector("input");
    if (document.activeElement !== field || field.value.trim() !== thing.name) field.value = thing.name;
    const details = `frame ${thing.frame}, ${size}${thing.stored ? ", stored" : ""}`;
    item.querySelector("span").textContent = details;
    item.style.borderLeftColor = COLOURS[k % COLOURS.length];
    item.className = thing === state.chosen ? "chosen" : "";
  });
  $("none").hidden = state.things.length > 0;
  $("save").disabled = !state.things.some((t) => !t.stored);
  $("snap").disabled = !state.chosen;
  $("close").disabled = state.draft.length < 3;
  draw();
}

function newItem() {
  const item = document.createElement("li");
  const field = document.createElement("input");
  field.setAttribute("list", "known");
  field.setAttribute("aria-label", "Name");
  field.placeholder = "its name";
  const row = document.createElement("div");
  row.className = "row";
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = "Remove";
  row.append(document.createElement("span"), button);
  item.append(field, row);
  const own = () => state.things[[...$("things").children].indexOf(item)];
  const choose = () => {
    state.chosen = own() || null;
    if (state.chosen && state.chosen.frame !== state.frame) show(state.chosen.frame);
    list();
  };
  field.addEventListener("focus", choose);
  field.addEventListener("input", () => {
    own().name = field.value.trim();
    changed(own());
  });
  field.addEventListener("keydown", (event) => {
    if (event.key === "Enter") canvas.focus();
  });
  item.addEventListener("click", (event) => event.target !== button && choose());
  button.addEventListener("click", () => remove(own()));
  return item;
}

// ---- saving

async function save() {
  const fresh = state.things.filter((t) => !t.stored);
  const nameless = fresh.find((t) => !t.name);
  if (nameless) {
    tell("Give each thing a name first.", "bad");
    fieldOf(nameless).focus();
    return;
  }
  if (!fresh.length) return;
  $("save").disabled = true;
  tell("Storing ...");
  try {
    const sent = fresh.map(({ name, frame, corners: c }) => ({ name, frame, corners: c }));
    const { messages } = await ask("save", { things: sent });
    fresh.forEach((t) => { t.stored = true; });
    remember(fresh.map((t) => t.name));
    tell(`Stored.\n${messages.join("\n")}`, "good");
  } catch (fault) {
    tell(fault.message, "bad");
  }
  list();
}

async function finish() {
  const left = state.things.filter((t) => !t.stored).length + (state.draft.length > 0);
  if (left && !state.leaving) {
    state.leaving = true;
    const what = left > 1 ? `${left} outlines are not stored` : "One outline is not stored";
    tell(`${what}. Close and save, or press Done again to leave it.`, "bad");
    return;
  }
  await ask("done", {}).catch(() => {});
  state.things.forEach((t) => { t.stored = true; });
  document.body.textContent = "All done: this window may be closed.";
  document.body.className = "quiet";
}

async function snap() {
  const thing = state.chosen;
  if (!thing) return;
  try {
    const found = await ask("snap", { frame: thing.frame, corners: thing.corners });
    const same = JSON.stringify(found.corners) === JSON.stringify(thing.corners);
    thing.corners = found.corners;
    tell(same ? "No clear edges were found near this outline; it stays." : "");
    if (!same) changed(thing);
  } catch (fault) {
    tell(fault.message, "bad");
  }
}

function remember(names) {
  for (const name of names) state.known[name] = (state.known[name] || 0) + 1;
  $("known").replaceChildren(...Object.keys(state.known).map((name) => new Option(name, name)));
}

// ---- mouse and keys

canvas.addEventListener("pointerdown", (event) => {
  if (!state.image) return;
  canvas.focus();
  canvas.setPointerCapture(event.pointerId);
  const at = place(event);
  if (event.button !== 0) {
    state.moving = at;
    return;
  }
  const first = state.draft[0];
  if (state.draft.length >= 3 && distance(toScreen(first), at) <= GRAB) return closeOutline();
  state.dragged = state.draft.length ? null : cornerAt(at);
  if (state.dragged) {
    state.chosen = state.dragged.thing;
    list();
  } else if (event.detail < 2 || !state.draft.length) {
    putCorner(toPicture(at));
  } else if (distance(toScreen(state.draft[state.draft.length - 1]), at) > 4) {
    putCorner(toPicture(at)); // two quick clicks at different places are two corners
  }
});
canvas.addEventListener("pointermove", (event) => {
  const at = place(event);
  if (state.moving) {
    state.left += at[0] - state.moving[0];
    state.top += at[1] - state.moving[1];
    state.moving = at;
  } else if (state.dragged) {
    state.dragged.thing.corners[state.dragged.k] = inside(toPicture(at));
    changed(state.dragged.thing);
  }
  state.pointer = state.image ? inside(toPicture(at)) : null;
  draw();
});
canvas.addEventListener("pointerup", () => { state.moving = state.dragged = null; });
canvas.addEventListener("pointerleave", () => { state.pointer = null; draw(); });
canvas.addEventListener("dblclick", () => closeOutline());
canvas.addEventListener("contextmenu", (event) => event.preventDefault());
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), place(event));
}, { passive: false });
for (const change of ["focus", "blur"]) canvas.addEventListener(change, draw);

const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const KEYS = {
  Enter: closeOutline,
  Escape: () => { state.draft.pop(); list(); },
  Backspace: () => {
    if (state.draft.length) state.draft = [];
    else if (state.things.length) return remove(state.chosen || state.things[state.things.length - 1]);
    list();
  },
  " ": () => state.cross && putCorner(state.cross),
  "+": () => zoomBy(1.25), "=": () => zoomBy(1.25), "-": () => zoomBy(0.8), 0: fit,
  ",": () => show(state.target - 1), ".": () => show(state.target + 1),
};
KEYS.Delete = KEYS.Backspace;

document.addEventListener("keydown", (event) => {
  if ((event.ctrlKey || event.metaKey) && event.key === "s") {
    event.preventDefault();
    return save();
  }
  const typing = ["INPUT", "BUTTON", "SUMMARY"].includes(event.target.tagName);
  if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
  if (STEPS[event.key] && state.cross) {
    const by = event.shiftKey ? 10 : 1;
    state.cross = inside(state.cross.map((n, k) => n + by * STEPS[event.key][k]));
    state.pointer = state.cross;
    draw();
  } else if (KEYS[event.key]) {
    KEYS[event.key]();
  } else return;
  event.preventDefault();
});

$("name").addEventListener("keydown", (event) => { if (event.key === "Enter") canvas.focus(); });
$("slider").addEventListener("input", (event) => show(Number(event.target.value)));
$("frame").addEventListener("change", (event) => show(Number(event.target.value)));
$("earlier").addEventListener("click", () => show(state.target - 1));
$("later").addEventListener("click", () => show(state.target + 1));
$("smaller").addEventListener("click", () => zoomBy(0.8));
$("larger").addEventListener("click", () => zoomBy(1.25));
$("fit").addEventListener("click", fit);
$("close").addEventListener("click", closeOutline);
$("snap").addEventListener("click", snap);
$("save").addEventListener("click", save);
$("done").addEventListener("click", finish);
window.addEventListener("resize", resize);
window.addEventListener("beforeunload", (event) => {
  if (state.things.some((t) => !t.stored)) event.preventDefault();
});

ask("clip.json").then((facts) => {
  state.count = facts.count;
  state.known = facts.known;
  remember([]);
  $("slider").max = $("frame").max = facts.count === null ? 0 : facts.count - 1;
  const knows = Object.keys(facts.known).length;
  $("clip").textContent = `${facts.clip}, into ${facts.models}` + (knows ? `, which knows ${knows} things` : "");
  document.title = `visup teach: ${facts.clip}`;
  resize();
  list();
  show(facts.frame);
}).catch((fault) => tell(fault.message, "bad"));
