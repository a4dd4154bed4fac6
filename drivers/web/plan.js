// What the pages share: a plan in clinical terms, its rigid motions, movements in words, the profile of a skin.
"use strict";

const byId = id => document.getElementById(id);
const BEFORE = 0, NOW = 1;  // states of a view

// How numbers are shown: [label, of a placement, axis, sign, unit]. +x left, +y back, +z up.
const NUMBERS = [
  ["forward", "translate", 1, -1, "mm"], ["up", "translate", 2, 1, "mm"],
  ["to the patient's left", "translate", 0, 1, "mm"], ["pitch, front down", "rotate", 0, 1, "°"],
  ["yaw, front to the left", "rotate", 2, 1, "°"], ["roll, left side up", "rotate", 1, -1, "°"]];
const DEGREE = Math.PI / 180;

// A vector along the axes of the head, its rows, and back.
const alongHead = (axes, v) => axes.map(row => row.reduce((sum, x, a) => sum + x * v[a], 0));
const alongScan = (axes, v) => [0, 1, 2].map(a => axes.reduce((sum, row, k) => sum + row[a] * v[k], 0));

// Positions along the axes of the head.
function turned(axes, position) {
  const along = new Float32Array(position.length);
  for (let i = 0; i < position.length; i += 3)
    for (let k = 0; k < 3; ++k)
      along[i + k] = axes[k][0] * position[i] + axes[k][1] * position[i + 1] + axes[k][2] * position[i + 2];
  return along;
}

// Each component as near to its value as its range either way allows.
const within = (range, values) => values.map((v, a) => Math.min(Math.max(v, -range[a]), range[a]));

// A motion's vector of a kind with another number along an axis of the head, within the box of the plan.
function withNumber(axes, range, vector, axis, value) {
  const along = alongHead(axes, vector);
  along[axis] = value;
  return within(range, alongScan(axes, along));
}

const zero = () => ({translate: [0, 0, 0], rotate: [0, 0, 0]});
const copyOf = plan => JSON.parse(JSON.stringify(plan));

function quaternionOf({rotate}) {
  const angle = Math.hypot(...rotate);
  return angle > 0 ? new THREE.Quaternion().setFromAxisAngle(
    new THREE.Vector3(...rotate).divideScalar(angle), angle * DEGREE) : new THREE.Quaternion();
}

function rotationOf(quaternion) {
  const {x, y, z, w} = quaternion.w < 0 ? quaternion.clone().set(
    -quaternion.x, -quaternion.y, -quaternion.z, -quaternion.w) : quaternion;
  const sine = Math.hypot(x, y, z);
  const scale = sine > 1e-12 ? 2 * Math.atan2(sine, w) / sine / DEGREE : 2 / DEGREE;
  return [x * scale, y * scale, z * scale];
}

// The 4×4 matrix of a placement about a centroid, as rows.
function matrixOf(placement, centroid) {
  const shift = new THREE.Vector3(...centroid), turn = new THREE.Matrix4()
    .makeRotationFromQuaternion(quaternionOf(placement));
  const moved = shift.clone().add(new THREE.Vector3(...placement.translate))
    .sub(shift.clone().applyMatrix4(turn));
  turn.setPosition(moved);
  const m = turn.elements;
  return [0, 1, 2, 3].map(row => [0, 1, 2, 3].map(column => m[4 * column + row]));
}

// Length of the movement of each vertex, mm.
function movementOf(position, initial) {
  const length = new Float32Array(position.length / 3);
  for (let i = 0; i < length.length; ++i) length[i] = Math.hypot(
    position[3 * i] - initial[3 * i], position[3 * i + 1] - initial[3 * i + 1],
    position[3 * i + 2] - initial[3 * i + 2]);
  return length;
}

// Moves the bones of a view as a plan does, whose pieces have these centroids.
function moveBones(bones, plan, centroids) {
  for (const bone of bones) {
    if (!centroids[bone.name]) continue;
    const mesh = bone.object(NOW);
    mesh.matrixAutoUpdate = false;
    mesh.matrix.set(...matrixOf(plan[bone.name], centroids[bone.name]).flat());
    mesh.matrixWorldNeedsUpdate = true;
  }
}

// The parts of a shift that count, in words.
function partsInWords([x, y, z]) {
  return [[-y, "forward", "back"], [z, "up", "down"], [x, "to the left", "to the right"]]
    .filter(([value]) => Math.abs(value) >= 0.05)
    .map(([value, plus, minus]) => `${Math.abs(value).toFixed(1)} ${value > 0 ? plus : minus}`);
}

const shiftInWords = shift => [`${Math.hypot(...shift).toFixed(2)} mm`, ...partsInWords(shift)].join(", ");

// Segments of the skin in the plane x = middle, as [y, z, y, z].
function profileOf(position, triangles, middle) {
  const segments = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const cut = [];
    for (let k = 0; k < 3; ++k) {
      const a = 3 * triangles[t + k], b = 3 * triangles[t + (k + 1) % 3];
      const from = position[a] - middle, to = position[b] - middle;
      if ((from < 0) === (to < 0)) continue;
      const share = from / (from - to);
      cut.push(position[a + 1] + share * (position[b + 1] - position[a + 1]),
               position[a + 2] + share * (position[b + 2] - position[a + 2]));
    }
    if (cut.length === 4) segments.push(cut);
  }
  return segments;
}

// Draws two profiles into an SVG element; returns how far the foremost point goes, in words.
function drawProfiles(svg, before, now) {
  const all = before.concat(now).flat();
  if (!all.length) return "";
  const bound = parity => all.filter((_, i) => i % 2 === parity)
    .reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const [front, back] = bound(0), [bottom, top] = bound(1);
  svg.setAttribute("viewBox", `${-back - 4} ${-top - 4} ${back - front + 8} ${top - bottom + 8}`);
  const path = segments => segments.map(([y, z, v, w]) =>
    `M${(-y).toFixed(2)} ${(-z).toFixed(2)}L${(-v).toFixed(2)} ${(-w).toFixed(2)}`).join("");
  svg.innerHTML = [["#9a9a9a", before], ["#1f6fb4", now]].map(([color, segments]) =>
    `<path d="${path(segments)}" fill="none" stroke="${color}" stroke-width="0.9"/>`).join("");
  const most = segments => segments.reduce((least, one) => Math.min(least, one[0], one[2]), Infinity);
  const forward = most(before) - most(now);
  return `the foremost point goes ${Math.abs(forward).toFixed(1)} mm ` +
    (forward >= 0 ? "forward" : "back");
}

// Draws the profile of a page through the middle of its view: initially and now.
function showProfile(page, axes) {
  const middle = alongHead(axes, page.viewer.center.toArray())[0];
  const profile = position => profileOf(turned(axes, position), page.triangles, middle);
  page.profileBefore ??= profile(page.initial);
  const said = drawProfiles(byId("profile"), page.profileBefore, profile(page.position));
  byId("measured").textContent = said && `; ${said}`;
}

// Sets the scale of a viewer, from 0, and draws its color bar.
function showScale(viewer, high, shown) {
  byId("high").textContent = String(high);
  byId("bar").hidden = !shown;
  viewer.setScale({low: 0, high});
  const canvas = byId("ramp"), context = canvas.getContext("2d");
  for (let i = 0; i < canvas.width; ++i) {
    context.fillStyle = `rgb(${rampColor(viewer.scale.ramp, i / (canvas.width - 1)).map(Math.round)})`;
    context.fillRect(i, 0, 1, canvas.height);
  }
}
