// The page of drivers/live.py: bones are dragged, the face follows. At once by the derivatives of
// the latest plan solved with them ("preview"), and exactly as soon as the solver has answered.
// Where no derivatives are known, the face of the former plan stays and is marked as such.
"use strict";

const TOKEN = new URLSearchParams(location.search).get("token");
const COMPONENTS = ["tx", "ty", "tz", "rx", "ry", "rz"];
const KEPT = 2;  // a state of the view beside BEFORE and NOW
const NOTICE_TIME = 5000;  // ms
const PATIENCE = 1000;     // ms, at first, with a window that overtakes this one
const ROUNDING = 1e-9;     // mm or degrees
const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);

async function ask(path, request) {
  const response = await fetch(path, request === undefined
    ? {headers: {"X-Token": TOKEN}}
    : {method: "POST", headers: {"X-Token": TOKEN}, body: JSON.stringify(request)});
  if (!response.ok) throw new Error((await response.text()).trim());
  return response.arrayBuffer();
}

// An answer of repose-live: a line of JSON, then arrays.
function unpack(buffer) {
  const bytes = new Uint8Array(buffer), end = bytes.indexOf(10);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end))), arrays = {};
  let at = end + 1;
  for (const {name, type, shape} of head.arrays) {
    const size = 4 * shape.reduce((product, n) => product * n, 1);
    const part = buffer.slice(at, at + size);
    arrays[name] = type === "f4" ? new Float32Array(part) : new Uint32Array(part);
    at += size;
  }
  return {head, arrays};
}

class Planner {
  constructor({head, arrays}) {
    this.head = head;
    this.pieces = new Map(head.pieces.map(piece => [piece.name, piece]));
    this.centroids = Object.fromEntries(head.pieces.map(({name, centroid}) => [name, centroid]));
    this.scenePlan = Object.fromEntries(head.pieces.map(({name, translate, rotate}) =>
      [name, {translate, rotate}]));
    this.plan = copyOf(this.scenePlan);
    this.past = [];
    this.future = [];
    this.reference = null;  // {plan, position, columns}: the latest solved with tangents
    this.exact = null;      // {plan, position}: the latest solved
    this.lower = null;      // plan that was solved from the initial state
    this.asked = this.overtaken = 0;
    this.solved = arrays.position;  // initial positions of the skin that is solved
    // It has no cuts: lips that part are shown on the skin that is solved.
    this.own = !head.cuts && arrays.given_rows && {rows: arrays.given_rows, weights: arrays.given_weights,
                                     position: arrays.given_position};
    this.initial = this.own ? arrays.given_position : arrays.position;
    this.triangles = this.own ? arrays.given_triangles : arrays.triangles;
    this.makeView(arrays);
    this.makePanel();
    this.choose(head.pieces[head.pieces.length - 1].name);
    this.change(this.plan, false);
  }

  makeView(arrays) {
    this.viewer = new FaceViewer(byId("view"), this.head.axes);
    this.skin = this.viewer.add({name: "skin", triangles: this.triangles,
                                 states: [this.initial, this.initial.slice(), null]});
    this.bones = this.head.bones.map((name, row) => {
      const points = arrays[`bone_${row}_points`];
      const states = [points, this.pieces.has(name) ? points.slice() : points, null];
      return this.viewer.add({name, kind: "bone", states,
                              triangles: arrays[`bone_${row}_triangles`]});
    });
    this.viewer.fit(this.initial);
    this.viewer.onHover = hit => this.tell(hit);
    this.makeGizmo();
    this.viewer.look("three-quarter");
  }

  makeGizmo() {
    const {scene, camera, renderer, controls} = this.viewer.three;
    this.handle = new THREE.Group();
    scene.add(this.handle);
    this.gizmo = new THREE.TransformControls(camera, renderer.domElement);
    this.gizmo.setSize(0.9);
    const helper = this.gizmo.getHelper();
    scene.add(helper);
    this.gizmo.attach(this.handle);
    this.gizmo.addEventListener("change", () => this.viewer.draw());
    this.viewer.onPane = ({state, left, width}, height) => {  // side by side: beside "now" alone
      helper.visible = state === NOW || this.viewer.shown.mode !== "side";
      if (helper.visible) this.gizmo.viewport = {x: left, y: 0, z: width, w: height};
    };
    this.gizmo.addEventListener("dragging-changed", event => {
      controls.enabled = !event.value;
      if (event.value) this.begin = copyOf(this.plan);
      else this.remember(this.begin);
    });
    this.gizmo.addEventListener("objectChange", () => this.dragged());
  }

  makePanel() {
    for (const name of this.pieces.keys()) {
      const button = document.createElement("button");
      button.textContent = name;
      button.setAttribute("role", "radio");
      button.onclick = () => this.choose(name);
      byId("pieces").append(button);
    }
    this.inputs = NUMBERS.map(([label, key, axis, sign, unit]) => {
      const row = document.createElement("label"), input = document.createElement("input");
      const range = this.head.box[key][axis];
      Object.assign(input, {type: "number", step: 0.5, min: -range, max: range, value: 0});
      input.setAttribute("aria-label", label);
      row.append(label, input, unit);
      byId("numbers").append(row);
      input.addEventListener("change", () => {
        const plan = copyOf(this.plan), value = Number(input.value);
        if (!Number.isFinite(value) || input.value === "") return this.showNumbers();
        const {axes, box} = this.head, motion = plan[this.chosen];
        motion[key] = withNumber(axes, box[key], motion[key], axis, sign * value);
        this.change(plan);
      });
      return input;
    });
    this.connect();
    this.viewer.setScale({low: 0});
  }

  connect() {
    const click = (id, work) => { byId(id).onclick = work; };
    click("move", () => this.setGizmo("translate"));
    click("turn", () => this.setGizmo("rotate"));
    click("undo", () => this.step(this.past, this.future));
    click("redo", () => this.step(this.future, this.past));
    click("reset", () => this.change(Object.fromEntries(
      [...this.pieces.keys()].map(name => [name, zero()]))));
    click("scene", () => this.change(copyOf(this.scenePlan)));
    click("keep", () => this.keep());
    click("save_scene", () => this.saveScene());
    click("save_stl", () => this.saveStl());
    click("save_result", () => this.write("/result"));
    click("save_report", () => this.write("/report"));
    byId("mode").onchange = () => this.showMode();
    byId("look").onchange = () => this.viewer.look(byId("look").value);
    byId("colored").onchange = () => this.color();
    byId("opacity").oninput = () => this.setOpacity();
    addEventListener("keydown", event => this.key(event));
    this.setOpacity();
  }

  key(event) {
    if (event.target.matches?.("input, select")) return;
    const key = event.key.toLowerCase();
    if (key === "w") this.setGizmo("translate");
    if (key === "e") this.setGizmo("rotate");
    if (event.key === "Escape" && this.gizmo.dragging) {
      this.gizmo.reset();
      this.dragged();
      this.gizmo.pointerUp({button: 0});  // the pointer moves nothing until it is pressed again
    }
    if (!event.ctrlKey && !event.metaKey) return;
    if (key === "z") this.step(this.past, this.future);
    if (key === "y") this.step(this.future, this.past);
  }

  isAt(plan) {
    return [...this.pieces.keys()].every(name => isSame(this.plan[name], plan[name]));
  }

  setGizmo(mode) {
    this.gizmo.setMode(mode);
    byId("move").setAttribute("aria-pressed", mode === "translate");
    byId("turn").setAttribute("aria-pressed", mode === "rotate");
    this.viewer.draw();
  }

  setOpacity() {
    this.skin.setStyle({opacity: byId("opacity").value / 100});
    this.viewer.draw();
  }

  choose(name) {
    this.chosen = name;
    byId("piece").textContent = name;
    for (const button of byId("pieces").children)
      button.setAttribute("aria-checked", button.textContent === name);
    this.placeHandle();
    this.showNumbers();
    this.viewer.draw();
  }

  placeHandle() {
    const {centroid} = this.pieces.get(this.chosen), {translate} = this.plan[this.chosen];
    this.handle.position.set(...centroid.map((x, a) => x + translate[a]));
    this.handle.quaternion.copy(quaternionOf(this.plan[this.chosen]));
    this.handle.updateMatrixWorld();
  }

  showNumbers() {
    NUMBERS.forEach(([, key, axis, sign], k) => {
      const along = alongHead(this.head.axes, this.plan[this.chosen][key]);
      this.inputs[k].value = String(Number((sign * along[axis]).toFixed(2)));
    });
  }

  // The gizmo has moved its handle: the plan follows, within the box.
  dragged() {
    const {centroid} = this.pieces.get(this.chosen), {box} = this.head;
    const plan = copyOf(this.plan);
    plan[this.chosen] = {
      translate: within(box.translate, this.handle.position.toArray().map((x, a) => x - centroid[a])),
      rotate: within(box.rotate, rotationOf(this.handle.quaternion))};
    this.change(plan, false);
  }

  remember(before) {
    if (isSame(before, this.plan)) return;
    this.past.push(before);
    this.future = [];
    this.showHistory();
  }

  step(from, to) {
    if (!from.length) return;
    to.push(copyOf(this.plan));
    this.change(from.pop(), false);
    this.showHistory();
  }

  showHistory() {
    byId("undo").disabled = !this.past.length;
    byId("redo").disabled = !this.future.length;
  }

  // Takes another plan: preview at once, the exact face when the solver has it.
  change(plan, remembered = true) {
    const before = this.plan;
    this.plan = plan;
    this.lower = null;
    this.overtaken = 0;
    if (remembered) this.remember(before);
    this.showHistory();
    this.placeHandle();
    this.showNumbers();
    moveBones(this.bones, this.plan, this.centroids);
    for (const id of ["under", "written", "cautions", "notice"]) byId(id).textContent = "";
    byId("angles").style.visibility = "hidden";
    this.preview();
    this.solveSoon();
  }

  preview() {
    const position = this.firstOrder();
    if (position) {
      this.showFace(position);
      this.mark("preview", "preview");
    } else {
      this.setFormer(true);
      this.mark("former", `face ${this.position ? "of the former plan" : "before any move"}, solving …`);
    }
  }

  // Positions to first order, or null where a derivative that they need is not known.
  firstOrder() {
    const {exact, reference} = this;
    if (isSame(exact?.plan, this.plan)) return exact.position;
    const position = reference?.position.slice();
    for (const name of reference ? this.pieces.keys() : [])
      for (const [index, component] of COMPONENTS.entries()) {
        const key = index < 3 ? "translate" : "rotate", axis = index % 3;
        const by = this.plan[name][key][axis] - reference.plan[name][key][axis];
        if (Math.abs(by) < ROUNDING) continue;
        const values = reference.columns.get(`${name} ${component}`);
        if (!values) return null;
        for (let i = 0; i < position.length; ++i) position[i] += by * values[i];
      }
    return position ?? null;
  }

  // Sets whether the face that is shown is not of this plan. It is then not kept or saved as if it were.
  setFormer(former) {
    const other = former && this.position;
    this.former = former;
    byId("which").textContent = other ? "former plan" : "now";
    byId("unit").textContent = `${other ? "former plan" : "movement"}, mm`;
    if (former) byId("measured").textContent = "";
    for (const id of ["keep", "save_stl"]) byId(id).disabled = former;
    byId("mode").querySelector("[value=plans]").disabled = former && !this.kept;
  }

  showFace(position) {
    this.setFormer(false);
    this.position = this.follow(position);
    this.skin.setPositions(NOW, this.position);
    this.color();
    showProfile(this, this.head.axes);
  }

  // The positions that are shown: of the scene's own skin, carried along, where another is solved.
  follow(position) {
    if (!this.own) return position;
    const {rows, weights, position: own} = this.own, moved = own.slice(), {solved} = this;
    for (let i = 0, k = 0; i < moved.length; i += 3)
      for (let n = 0; n < 16; ++n, ++k) {
        const weight = weights[k], row = 3 * rows[k];
        if (weight) for (let a = 0; a < 3; ++a)
          moved[i + a] += weight * (position[row + a] - solved[row + a]);
      }
    return moved;
  }

  mark(kind, text) {
    byId("mark").className = kind;
    byId("mark").textContent = text;
  }

  solveSoon() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.solve(false), 60);
  }

  // Solves this plan from the initial state, where that was found to end at less energy.
  takeLower() {
    if (isSame(this.lower, this.plan)) return;
    this.lower = copyOf(this.plan);
    clearTimeout(this.timer);
    this.solve(true, {base: "rest", other_rest: true});
  }

  async solve(tangents, start = {}) {
    const number = ++this.asked, plan = copyOf(this.plan);
    const current = () => number === this.asked && isSame(plan, this.plan);
    try {
      const answer = await ask("/solve", {plan, tangents, summary: tangents, ...start});
      if (!answer.byteLength) {  // overtaken by another plan, of this window or of another one
        const pause = PATIENCE * 2 ** this.overtaken++ * (1 + Math.random());
        if (current()) this.timer = setTimeout(() => this.solve(tangents, start), pause);
        return;
      }
      this.overtaken = 0;
      const {head, arrays} = unpack(answer);
      if (head.converged) this.exact = {plan, position: arrays.position};
      if (head.converged && isSame(plan, this.keptPlan)) this.keepFace(this.follow(arrays.position), true);
      if (tangents) this.takeTangents(plan, head, arrays);
      if (!current()) return;
      this.showFace(arrays.position);
      byId("angles").style.visibility = "visible";
      byId("angles").textContent = (head.angles ?? []).map(({name, before, after}) =>
        `${name} ${after.toFixed(1)}° (before ${before.toFixed(1)}°)`).join("; ");
      byId("cautions").textContent = head.cautions.join("\n");
      const lower = start.base ? ", of less energy" : "";
      const warnings = head.cautions.length ? `, warnings: ${head.cautions.length}` : "";
      if (!head.converged) this.mark("failed", `not converged: ${head.reason}`);
      else this.mark("exact", `exact to ${Math.max(head.error, 0.001).toFixed(3)} mm${lower}${warnings}`);
      if (!tangents) this.timer = setTimeout(() => this.solve(true), 150);
    } catch (error) {
      if (current()) this.mark("failed", error.message);
    }
  }

  takeTangents(plan, {flags}, arrays) {
    const columns = new Map();
    for (const [name, values] of Object.entries(arrays)) {
      const [, bone, component] = name.match(/^tangent_(\d+)_(..)$/) ?? [];
      if (component && Object.values(flags[name]).every(Boolean))
        columns.set(`${this.head.bones[Number(bone)]} ${component}`, values);
    }
    this.reference = {plan, position: arrays.position, columns};
  }

  movement(position) { return movementOf(position, this.initial); }

  color() {
    if (!this.position) return;
    const colored = byId("colored").checked, now = this.movement(this.position);
    const kept = this.kept && this.movement(this.kept);
    const farthest = (values, least) => values.reduce((most, v) => Math.max(most, v), least);
    showScale(this.viewer, Math.ceil(farthest(kept ?? [], farthest(now, 1))), colored);
    this.skin.setField(NOW, colored ? now : null);
    if (kept) this.skin.setField(KEPT, colored ? kept : null);
    this.viewer.draw();
  }

  tell(hit) {
    const text = hit?.surface === this.skin && this.position ? this.describe(hit) : "";
    byId("under").textContent = text;
  }

  describe(hit) {
    const position = hit.state === KEPT ? this.kept : hit.state === NOW ? this.position
      : this.initial;
    const shift = hit.at(position, 3).map((x, a) => x - hit.at(this.initial, 3)[a]);
    return (hit.state === NOW && this.former ? "former plan: "
      : hit.state === KEPT && !this.keptExact ? "plan A, preview: " : "") +
      shiftInWords(alongHead(this.head.axes, shift));
  }

  // The face is a preview until the exact one of its plan is there.
  keepFace(position, exact) {
    this.kept = position.slice();
    this.keptExact = exact;
    this.skin.setPositions(KEPT, this.kept);
  }

  keep() {
    this.keptPlan = copyOf(this.plan);
    this.keepFace(this.position, isSame(this.exact?.plan, this.plan));
    this.bones.forEach(bone => {
      bone.setPositions(KEPT, bone.positions[NOW]);
      const piece = this.pieces.get(bone.name), mesh = bone.object(KEPT);
      mesh.matrixAutoUpdate = false;
      mesh.matrix.copy(piece ? bone.object(NOW).matrix : new THREE.Matrix4());
    });
    byId("mode").value = "plans";
    this.showMode();
    this.color();
  }

  showMode() {
    if (byId("mode").selectedOptions[0].disabled) byId("mode").value = "after";
    const mode = byId("mode").value;
    if (mode === "plans" && !this.kept) return this.keep();
    this.viewer.show(mode === "after" ? {mode: "single", states: [NOW, NOW]}
      : mode === "split" ? {mode, states: [BEFORE, NOW]}
      : mode === "side" ? {mode, states: [BEFORE, NOW]}
      : {mode: "split", states: [KEPT, NOW]});
  }

  async saveScene() {
    const moves = Object.fromEntries([...this.pieces].map(([name, {centroid}]) =>
      [name, matrixOf(this.plan[name], centroid)]));
    try {
      this.save("plan.yaml", await ask("/scene_file", {moves}));
    } catch (error) {
      this.mark("failed", error.message);
    }
  }

  saveStl() {
    const {triangles, position} = this, count = triangles.length / 3;
    const view = new DataView(new ArrayBuffer(84 + 50 * count));
    view.setUint32(80, count, true);
    for (let t = 0; t < count; ++t) for (let k = 0; k < 3; ++k) for (let a = 0; a < 3; ++a)
      view.setFloat32(84 + 50 * t + 12 + 12 * k + 4 * a, position[3 * triangles[3 * t + k] + a], true);
    this.save("skin.stl", view.buffer);
  }

  save(name, content) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([content]));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  async write(what) {
    const plan = copyOf(this.plan);
    try {
      const path = new TextDecoder().decode(await ask(what, {plan}));
      byId("written").textContent = `written${isSame(plan, this.plan) ? "" : " of an earlier plan"}: ${path}`;
    } catch (error) {
      this.mark("failed", error.message);
    }
  }
}

// Shows how this plan was verified from a cold start, or that the scene has changed.
async function showNotice() {
  try {
    const {text, good, plan, lower} = JSON.parse(new TextDecoder().decode(await ask("/notice")));
    byId("notice").textContent = !plan || planner.isAt(plan) ? text : "";
    byId("notice").className = good ? "" : "bad";
    if (lower && planner.isAt(plan)) planner.takeLower();
  } catch (error) {
    byId("notice").textContent = `the server of this page does not answer: ${error.message}`;
    byId("notice").className = "bad";
  }
}

async function main() {
  try {
    byId("title").textContent = document.title;
    window.planner = new Planner(unpack(await ask("/scene")));
    byId("mode").onchange();
    setInterval(showNotice, NOTICE_TIME);
  } catch (error) {
    byId("mark").className = "failed";
    byId("mark").textContent = error.message;
  }
}

main();
