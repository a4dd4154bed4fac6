// The page of drivers/map.py: the face of every plan of a box, from a fit to some that were solved.
// Nothing is loaded and nothing computed elsewhere. The formulas are those of
// drivers/python/repose/kriging.py and map.py.
"use strict";

const SMALLEST = 0.05;   // mm or degrees: a number that moves less has no slider
const MOST_ERROR = 0.5;  // mm: beyond, the face is gray

function doubles(bytes, {at, count}) {
  return new Float64Array(bytes.slice(at, at + 8 * count).buffer);
}

// A Gaussian process with derivatives, given by its weights.
class Kriging {
  constructor(described, bytes) {
    Object.assign(this, described);  // samples, dimensions, modes, length, reach, spread_nugget
    this.u = doubles(bytes, described.u);
    this.rows = unpack(bytes, described.rows);  // of the data: value of sample i, or slope i·d + k
    this.weights = doubles(bytes, described.weights);
    this.trend = doubles(bytes, described.trend);
    this.precision = doubles(bytes, described.precision);
  }

  // The coefficients of the modes at u.
  predict(u) {
    const {samples, dimensions: d, modes, length} = this, sum = new Float64Array(modes);
    const add = (weights, row, by) => {
      for (let m = 0, at = row * modes; m < modes; ++m, ++at) sum[m] += by * weights[at];
    };
    const value = new Float64Array(samples), first = new Float64Array(samples);
    for (let i = 0; i < samples; ++i) {
      let r = 0;
      for (let k = 0; k < d; ++k) r += ((u[k] - this.u[i * d + k]) / length[k]) ** 2;
      r = Math.sqrt(5 * r);
      value[i] = (1 + r + r * r / 3) * Math.exp(-r);
      first[i] = 5 / 3 * (1 + r) * Math.exp(-r);
    }
    this.rows.forEach((row, at) => {
      if (row < samples) return add(this.weights, at, value[row]);
      const i = Math.floor((row - samples) / d), k = (row - samples) % d;
      add(this.weights, at, first[i] * (u[k] - this.u[i * d + k]) / length[k] ** 2);
    });
    let term = 0;
    add(this.trend, term++, 1);
    for (let k = 0; k < d; ++k) add(this.trend, term++, u[k]);
    for (let k = 0; k < d; ++k) for (let l = k; l < d; ++l) add(this.trend, term++, u[k] * u[l]);
    return sum;
  }

  // How far u is from the samples, as a standard deviation.
  spread(u) {
    const {samples, dimensions: d, reach, spread_nugget: nugget} = this;
    const cross = new Float64Array(samples);
    for (let i = 0; i < samples; ++i) {
      let r = 0;
      for (let k = 0; k < d; ++k) r += (u[k] - this.u[i * d + k]) ** 2;
      r = Math.sqrt(5 * r) / reach;
      cross[i] = (1 + r + r * r / 3) * Math.exp(-r);
    }
    let known = 0;
    for (let i = 0; i < samples; ++i)
      for (let j = 0; j < samples; ++j) known += cross[i] * cross[j] * this.precision[i * samples + j];
    return Math.sqrt(Math.max(1 + nugget - known, nugget));
  }
}

class MapPage {
  constructor(described, bytes) {
    this.described = described;
    this.kriging = new Kriging(described.kriging, bytes);
    this.initial = unpack(bytes, described.skin.points);
    this.triangles = unpack(bytes, described.skin.triangles);
    this.mean = unpack(bytes, described.skin.mean);
    this.shapes = described.skin.shapes.map(one => unpack(bytes, one));
    this.factor = unpack(bytes, described.skin.factor);
    this.failed = doubles(bytes, described.failed);
    this.below = described.bounded ? "below" : "about";
    this.makeView(bytes);
    this.makeSliders();
    this.connect();
    byId("about").textContent = described.about;
    this.change(copyOf(described.scene_plan));
    this.viewer.look("three-quarter");
  }

  makeView(bytes) {
    this.viewer = new FaceViewer(byId("view"), this.described.axes);
    this.skin = this.viewer.add({name: "skin", triangles: this.triangles,
                                 states: [this.initial, this.initial.slice()]});
    this.bones = this.described.bones.map(({name, points, triangles}) => {
      const places = unpack(bytes, points);
      return this.viewer.add({name, kind: "bone", triangles: unpack(bytes, triangles),
                              states: [places, places.slice()]});
    });
    this.viewer.fit(this.initial);
    this.viewer.onHover = hit => this.tell(hit);
  }

  makeSliders() {
    this.inputs = [];
    const {axes, box, pieces} = this.described;
    for (const piece of pieces) {
      const group = document.createElement("fieldset"), legend = document.createElement("legend");
      legend.textContent = piece;
      group.append(legend);
      for (const [label, key, axis, sign, unit] of NUMBERS) {
        const reach = box[key].reduce((sum, half, a) => sum + half * Math.abs(axes[axis][a]), 0);
        if (reach < SMALLEST) continue;
        const line = document.createElement("label"), input = document.createElement("input");
        const output = document.createElement("output");
        const most = Math.round(10 * reach) / 10;
        Object.assign(input, {type: "range", min: -most, max: most, step: 0.1});
        input.setAttribute("aria-label", `${piece}: ${label}, ${unit}`);
        input.oninput = () => {
          if (this.drag?.input !== input || this.drag.made !== this.plan)
            this.drag = {input, plan: this.plan};  // a number that ends at the box takes others along
          const plan = copyOf(this.drag.plan), motion = plan[piece];
          motion[key] = withNumber(axes, box[key], motion[key], axis, sign * Number(input.value));
          this.drag.made = plan;
          this.change(plan);
        };
        line.append(label, input, output);
        group.append(line);
        this.inputs.push({input, output, piece, key, axis, sign, unit});
      }
      byId("sliders").append(group);
    }
  }

  connect() {
    const {pieces, scene_plan: scenePlan} = this.described;
    byId("reset").onclick = () =>
      this.change(Object.fromEntries(pieces.map(name => [name, zero()])));
    byId("scene").onclick = () => this.change(copyOf(scenePlan));
    byId("go_nearest").onclick = () => this.change(this.planOf(this.nearest().row));
    byId("copy").onclick = () => {
      byId("command").select();
      navigator.clipboard?.writeText(byId("command").value).catch(() => {});
    };
    byId("mode").onchange = () => this.showMode();
    byId("look").onchange = () => this.viewer.look(byId("look").value);
    byId("colors").onchange = () => this.color();
    byId("opacity").oninput = () => {
      this.skin.setStyle({opacity: byId("opacity").value / 100});
      this.viewer.draw();
    };
    byId("opacity").oninput();
    this.showMode();
  }

  showMode() {
    const split = byId("mode").value === "split";
    this.viewer.show(split ? {mode: "split", states: [BEFORE, NOW]}
                           : {mode: "single", states: [NOW, NOW]});
  }

  vector(plan) {
    const {coordinates, half} = this.described;
    return coordinates.map(([piece, key, axis], k) => plan[piece][key][axis] / half[k]);
  }

  planOf(row) {
    const {coordinates, half, pieces} = this.described, d = coordinates.length;
    const plan = Object.fromEntries(pieces.map(name => [name, zero()]));
    coordinates.forEach(([piece, key, axis], k) => {
      plan[piece][key][axis] = half[k] * this.kriging.u[row * d + k];
    });
    return plan;
  }

  displacementAt(u) {
    const coefficient = this.kriging.predict(u), sum = Float32Array.from(this.mean);
    this.shapes.forEach((shape, m) => {
      const by = coefficient[m];
      for (let i = 0; i < sum.length; ++i) sum[i] += by * shape[i];
    });
    return sum;
  }

  change(plan) {
    const began = performance.now();
    this.plan = plan;
    this.u = this.vector(plan);
    this.position = this.displacementAt(this.u).map((shift, i) => this.initial[i] + shift);
    const spread = this.kriging.spread(this.u);
    this.bound = this.factor.map(factor => Math.max(factor * spread, this.described.least_bound));
    this.seconds = (performance.now() - began) / 1000;
    this.skin.setPositions(NOW, this.position);
    moveBones(this.bones, this.plan, this.described.centroids);
    this.color();
    this.showNumbers();
    this.showTrust();
    showProfile(this, this.described.axes);
  }

  showNumbers() {
    for (const {input, output, piece, key, axis, sign, unit} of this.inputs) {
      const value = sign * alongHead(this.described.axes, this.plan[piece][key])[axis];
      input.value = String(value);
      output.textContent = `${value.toFixed(1).replace("-", "−").replace(/^−0\.0$/, "0.0")} ${unit}`;
    }
  }

  // The solved plan nearest to this one, in shares of the box: {row, share, mm, degrees}.
  nearest() {
    const {samples, dimensions: d} = this.kriging, {axes, pieces} = this.described;
    const distance = (points, i) => Math.hypot(...this.u.map((v, k) => v - points[i * d + k]));
    let row = 0;
    for (let i = 1; i < samples; ++i)
      if (distance(this.kriging.u, i) < distance(this.kriging.u, row)) row = i;
    const solved = this.planOf(row), apart = (piece, key) => alongHead(axes,
      this.plan[piece][key].map((x, a) => x - solved[piece][key][a])).map(Math.abs);
    const most = key => Math.max(...pieces.flatMap(piece => apart(piece, key)));
    const share = distance(this.kriging.u, row);
    let failing = false;
    for (let i = 0; i * d < this.failed.length; ++i) failing ||= distance(this.failed, i) < share;
    return {row, share, mm: most("translate"), degrees: most("rotate"), failing};
  }

  showTrust() {
    const sorted = Float32Array.from(this.bound).sort(), count = sorted.length;
    const most = sorted[Math.floor(0.95 * (count - 1))];
    const gray = sorted.reduce((sum, v) => sum + (v > MOST_ERROR), 0) / count;
    const {mm, degrees, failing} = this.nearest();
    const {bounded, least_bounded: least} = this.described;
    byId("mark").className = failing || gray > 0.05 || !bounded ? "preview" : "exact";
    byId("mark").textContent = failing
      ? "a plan near this one could not be solved: solve this one exactly"
      : `${bounded ? "within" : "about"} ${most.toFixed(2)} mm on 95 % of the skin` +
        (bounded ? "" : `: ${this.kriging.samples} plans are solved, a bound needs ${least}`) +
        (gray > 0 ? `; ${(100 * gray).toFixed(gray < 0.01 ? 1 : 0)} % of it uncertain (gray)` : "");
    byId("nearest").textContent = mm < 0.05 && degrees < 0.05 ? "This plan was solved itself."
      : `The numbers of the nearest solved plan differ by at most ${mm.toFixed(1)} mm and ` +
        `${degrees.toFixed(1)}°.`;
    byId("command").value = this.command();
  }

  command() {
    const round = values => values.map(v => Number(v.toFixed(3)));
    const plan = Object.fromEntries(Object.entries(this.plan).map(([piece, motion]) =>
      [piece, {translate: round(motion.translate), rotate: round(motion.rotate)}]));
    return `${this.described.command} -plan '${JSON.stringify(plan).replaceAll("'", "\\u0027")}'`;
  }

  color() {
    const shown = byId("colors").value, movement = movementOf(this.position, this.initial);
    const values = shown === "bound" ? this.bound : movement;
    const high = shown === "bound" ? MOST_ERROR
      : Math.max(1, Math.ceil(movement.reduce((most, v) => Math.max(most, v), 0)));
    byId("unit").textContent = shown === "bound" ? `error ${this.below}, mm` : "movement, mm";
    showScale(this.viewer, high, shown !== "none");
    this.skin.setField(NOW, shown === "none" ? null : values,
                       Array.from(this.bound, value => value > MOST_ERROR));
    this.viewer.draw();
  }

  tell(hit) {
    let text = "";
    if (hit?.surface === this.skin && hit.state === NOW) {
      const from = hit.at(this.initial, 3), shift = hit.at(this.position, 3).map((x, a) => x - from[a]);
      text = `${shiftInWords(alongHead(this.described.axes, shift))}; error ${this.below} ` +
        `${hit.at(this.bound)[0].toFixed(2)} mm`;
    }
    byId("under").textContent = text;
  }
}

async function main() {
  try {
    byId("title").textContent = document.title;
    const described = JSON.parse(byId("described").textContent);
    window.mapPage = new MapPage(described, await inflate(byId("packed").textContent));
    document.documentElement.dataset.ready = "1";
  } catch (error) {
    byId("mark").className = "failed";
    byId("mark").textContent = error.message;
    document.documentElement.dataset.ready = "1";
  }
}

main();
