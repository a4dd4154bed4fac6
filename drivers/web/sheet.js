// The planning sheet of report.py: unpacks the surfaces of the page, shows them by viewer.js, and
// connects the controls. All that is drawn lies in the page; nothing is loaded.
"use strict";

class Sheet {
  constructor(described, bytes) {
    this.described = described;
    this.viewer = new FaceViewer(byId("view"));
    for (const one of described.surfaces) this.addSurface(one, bytes);
    this.skin = this.viewer.surfaces[0];
    this.fields = new Map(described.fields.map(field => [field.name, {
      ...field, states: field.states.map(one => one && unpack(bytes, one))}]));
    this.addMovement();
    this.viewer.fit(described.frame);
    this.measured = [];
    this.connect();
    const choice = byId("coloring");
    for (const name of this.fields.keys()) choice.add(new Option(this.fields.get(name).label, name));
    this.viewer.look("three-quarter");
    this.setMode("split");
    this.color("");
  }

  addSurface({name, kind, triangles, states, colors, uv, image, oriented}, bytes) {
    const base = unpack(bytes, states[0] ?? states.find(Boolean));
    const positions = states.map((one, state) => {
      if (!one) return null;
      if (state === 0) return base;
      const moved = unpack(bytes, one);
      return moved.map((shift, i) => base[i] + shift);
    });
    const surface = this.viewer.add({
      name, kind, oriented, triangles: unpack(bytes, triangles), states: positions,
      colors: colors ? Uint8Array.from(unpack(bytes, colors)) : null,
      uv: uv ? unpack(bytes, uv) : null});
    if (!image) return;
    const photograph = new Image();
    photograph.onload = () => { surface.setStyle({image: photograph}); this.viewer.draw(); };
    photograph.src = image;
  }

  // Movement in mm of each vertex in each state after the first, and the difference of two plans.
  addMovement() {
    const {positions} = this.skin;
    const own = [null, ...positions.slice(1).map(after => movementOf(after, positions[0]))];
    const fields = [["movement", {label: "movement, mm", states: own, unit: "mm",
                                  high: this.described.largest}]];
    if (positions.length > 2) {
      const apart = movementOf(positions[2], positions[1]);
      fields.push(["difference", {label: "difference of the plans, mm", unit: "mm",
                                  states: [null, apart, apart], high: this.described.apart}]);
    }
    this.fields = new Map([...fields, ...this.fields]);
  }

  // Colors the skin by a field; by none: ("").
  color(name) {
    const field = this.fields.get(name), {ramp} = this.described;
    this.colored = name;
    byId("coloring").value = name;
    byId("bar").hidden = !field;
    if (field) {
      const colors = field.ramp ?? ramp;
      this.viewer.setScale({ramp: colors, low: 0, high: field.high || 1});
      byId("bar").innerHTML = `<b>${field.label}</b>` +
        `<i style="background:linear-gradient(90deg,${colors.map(c => `#${c}`).join(",")})"></i>` +
        `<span><span>${field.ends ? field.ends[0] : "0"}</span>` +
        `<span>${field.ends ? field.ends[1] : field.high.toFixed(1)}</span></span>`;
    }
    for (const bone of this.viewer.surfaces.slice(1))
      bone.setStyle({color: field ? "#b9c0ca" : "#f2e8cf"});
    this.skin.positions.forEach((_, state) => this.skin.setField(state, field?.states[state] ?? null));
    this.blend();
    this.viewer.draw();
  }

  setMode(mode) {
    this.mode = mode;
    for (const button of document.querySelectorAll("[data-mode]"))
      button.setAttribute("aria-pressed", button.dataset.mode === mode);
    byId("share-label").hidden = mode !== "single";
    this.blend();
    this.showStates();
  }

  pair() { return (byId("pair")?.value ?? "0 1").split(" ").map(Number); }

  showStates() {
    const [one, other] = this.pair(), names = this.described.states;
    const share = Number(byId("share").value);
    byId("share-from").textContent = names[one];
    byId("share-to").textContent = names[other];
    const single = share === 0 ? one : share === 1 ? other : FaceViewer.MIXED;
    this.viewer.show({mode: this.mode, states: this.mode === "single" ? [single] : [one, other]});
    byId("tag-left").textContent = this.mode !== "single" ? names[one]
      : single === FaceViewer.MIXED ? `${Math.round(100 * share)} % of the way` : names[single];
    byId("tag-right").hidden = this.mode === "single";
    byId("tag-right").textContent = names[other];
  }

  blend() {
    const share = Number(byId("share").value);
    if (this.mode === "single" && share > 0 && share < 1) this.viewer.mix(...this.pair(), share);
  }

  tell(hit, event) {
    const tip = byId("tip");
    tip.hidden = !hit;
    if (!hit) return;
    const box = byId("view").getBoundingClientRect();
    tip.textContent = this.sentence(hit);
    tip.style.left = tip.style.top = "0px"; // as wide as it can be
    const left = Math.min(event.clientX - box.left, box.width - tip.offsetWidth - 20);
    const top = Math.min(event.clientY - box.top, box.height - tip.offsetHeight - 20);
    tip.style.left = `${Math.max(0, left)}px`;
    tip.style.top = `${Math.max(0, top)}px`;
  }

  sentence({surface, state, at}) {
    const names = this.described.states, between = state === 0 || state === FaceViewer.MIXED;
    const after = between ? this.pair()[1] : state;
    if (!surface.positions[0] || !surface.positions[after]) return surface.name;
    const [from, to] = [0, after].map(k => at(surface.positions[k], 3));
    const shift = to.map((value, axis) => value - from[axis]);
    const plan = names.length > 2 ? `${names[after]}: ` : "";
    const place = surface === this.skin ? "" : `${surface.name}: `;
    const parts = partsInWords(shift).join(", "), moves = Math.hypot(...shift) < 0.05 ? "does not move"
      : `moves ${Math.hypot(...shift).toFixed(1)} mm${parts && `: ${parts}`}`;
    const unsure = this.fields.get("uncertainty")?.states[after];
    return plan + place + moves +
      (surface === this.skin && unsure ? `; uncertain by ${at(unsure)[0].toFixed(1)} mm` : "");
  }

  // Two clicks measure a distance; a third begins again.
  measure(hit) {
    if (!byId("measure").checked || !hit) return;
    if (this.measured.length === 2) this.measured = [];
    this.measured.push(hit);
    this.viewer.mark("distance", this.measured.map(one => one.point), "#1f6fb4");
    const told = byId("distance");
    if (this.measured.length < 2) {
      told.textContent = "Choose the second point.";
      return;
    }
    const names = this.described.states, apart = state => {
      const ends = this.measured.map(({surface, at}) =>
        surface.positions[state] && at(surface.positions[state], 3));
      return ends[0] && ends[1] && Math.hypot(...ends[0].map((value, k) => value - ends[1][k]));
    };
    told.textContent = names.map((name, state) => [name, apart(state)])
      .filter(([, distance]) => distance).map(([name, distance]) =>
        `${name} ${distance.toFixed(1)} mm`).join(", ");
  }

  connect() {
    const on = (id, event, act) => byId(id)?.addEventListener(event, act);
    for (const button of document.querySelectorAll("[data-view]"))
      button.addEventListener("click", () => this.viewer.look(button.dataset.view));
    for (const button of document.querySelectorAll("[data-mode]"))
      button.addEventListener("click", () => this.setMode(button.dataset.mode));
    on("coloring", "change", event => this.color(event.target.value));
    on("pair", "change", () => { this.blend(); this.showStates(); });
    on("share", "input", () => { this.blend(); this.showStates(); });
    on("skin", "input", event => {
      this.skin.setStyle({opacity: Number(event.target.value)});
      this.viewer.draw();
    });
    on("bones", "change", event => {
      for (const bone of this.viewer.surfaces.slice(1))
        bone.setStyle({visible: event.target.checked});
      this.viewer.draw();
    });
    on("measure", "change", event => {
      this.measured = [];
      this.viewer.mark("distance", null);
      byId("distance").textContent = event.target.checked ? "Choose two points of the face." : "";
    });
    this.viewer.onHover = (hit, event) => this.tell(hit, event);
    this.viewer.onClick = hit => this.measure(hit);
  }

  // Pictures for the print, where a view to turn is of no use: [[title, view, state, colored]].
  planStills() {
    const {states, largest} = this.described, many = states.length > 2;
    const views = many ? ["front", "right"] : ["front", "three-quarter", "right"];
    return [...[...states.entries()].flatMap(([state, name]) =>
              views.map(view => [name, view, state, false])),
            ...[...states.entries()].slice(1).flatMap(([state, name]) =>
              (many ? ["front"] : views).map(view =>
                [`${name}: movement, dark is ${largest.toFixed(1)} mm`, view, state, true]))];
  }

  makeStill([title, view, state, colored]) {
    const {low, high, ramp} = this.viewer.scale, kept = this.skin.fields[state] ?? null;
    this.viewer.setScale({low: 0, high: this.described.largest, ramp: this.described.ramp});
    this.skin.setField(state, colored ? this.fields.get("movement").states[state] : null);
    const figure = document.createElement("figure"), image = new Image();
    image.src = this.viewer.snapshot(480, 480, {view, state});
    image.alt = `${title}, ${view}`;
    figure.append(image, Object.assign(document.createElement("figcaption"), {textContent: title}));
    byId("stills").append(figure);
    this.viewer.setScale({low, high, ramp});
    this.skin.setField(state, kept);
    this.viewer.draw();
  }

  // One after another while nothing else happens; what is missing when the page is printed, then.
  makeStills() {
    const left = this.planStills(), next = () => {
      if (left.length) this.makeStill(left.shift());
      if (left.length) setTimeout(next, 30);
      else document.documentElement.dataset.stills = "yes";
    };
    window.addEventListener("beforeprint", () => { while (left.length) this.makeStill(left.shift()); });
    setTimeout(next, 5000);
  }
}

(async () => {
  const described = JSON.parse(byId("described").textContent);
  try {
    const sheet = new Sheet(described, await inflate(byId("packed").textContent));
    window.sheet = sheet;
    document.documentElement.dataset.ready = "yes";
    sheet.makeStills();
  } catch (reason) {
    byId("no-view").hidden = false;
    byId("no-view").textContent = reason.message;
    document.documentElement.dataset.ready = "failed";
  }
})();
