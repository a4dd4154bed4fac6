// A 3D view of a face and its bones in one or several states (before, after, another plan), for
// report.py and other pages. Needs three.js beside it (window.THREE) and viewer.css; no network.
//
//   const viewer = new FaceViewer(element, axes); // throws where the browser has no WebGL 2; axes: rows left,
//                                                 // back and up of the head, for views; or none
//   const skin = viewer.add({name: "skin", triangles, states: [before, after]});
//   viewer.add({name: "mandible", kind: "bone", triangles, states: [before, after]});
//   // further keys: colors (Uint8Array, 3 a vertex), uv (2 a vertex), oriented (triangles are
//   // counter-clockwise from outside: the inside is then drawn dark)
//   viewer.show({mode: "split", states: [0, 1]});
//   viewer.look("three-quarter");
//
// Positions are Float32Array of x y z in mm (+x patient left, +y posterior, +z up), triangles
// Uint32Array; a state that is null is not drawn. Methods of the viewer:
//   show({mode, states, split})  mode "single" (states[0]), "split" (states[0] left of a handle,
//                                states[1] right of it; split from 0 to 1) or "side" (two panes)
//   look(view)                   "front", "right", "left", "three-quarter"; the profile "right" faces
//                                right, as in all pictures of this project
//   setScale({ramp, low, high})  colors (hexadecimal, low to high) and range of all fields
//   mix(one, other, share)       fills the state `FaceViewer.MIXED` with what lies between two others
//   fit(points)                  centers the camera on positions
//   pick(event)                  {surface, state, point, triangle, weights, at(values)} under a pointer,
//                                or null; at() interpolates values of the vertices
//   mark(name, points, color)    draws small balls joined by a line; none removes them
//   snapshot(width, height, {view, state})  PNG as a data URL
//   draw()                       after changes made through `three` ({scene, camera, renderer,
//                                controls, THREE}), where a gizmo may be added
//   onHover, onClick             callbacks: (hit, event)
//   onPane                       callback before each pane is drawn: ({state, left, width}, height)
// Of a surface:
//   setPositions(state, positions)     new positions, for live updates; setField(state, values or
//   null, gray) colors it, NaN and where gray is true gray; setStyle({color, opacity, visible, image}); object(state) is
//   the THREE.Mesh, to be moved or given to a gizmo.
"use strict";

const REPOSE_RAMP = ["fcf3dc", "fed395", "fe9f6d", "f1605d", "c03a76", "832681", "4a1079"];
const REPOSE_LOOKS = {front: [0, -1, 0], right: [-1, 0, 0], left: [1, 0, 0],
                      "three-quarter": [-0.65, -0.75, 0.1]};

// The color of a share from 0 to 1 of a ramp of hexadecimal colors: [red, green, blue] to 255.
function rampColor(ramp, share) {
  const place = Math.min(Math.max(share, 0), 1) * (ramp.length - 1);
  const below = Math.min(Math.floor(place), ramp.length - 2);
  const part = (text, k) => parseInt(text.slice(2 * k, 2 * k + 2), 16);
  return [0, 1, 2].map(k => part(ramp[below], k) +
    (place - below) * (part(ramp[below + 1], k) - part(ramp[below], k)));
}

// Draws the back of a surface, as seen through an open mouth, dark.
function darkenInside(material) {
  material.onBeforeCompile = shader => {
    shader.fragmentShader = shader.fragmentShader.replace("#include <color_fragment>",
      "#include <color_fragment>\nif (!gl_FrontFacing) diffuseColor.rgb = vec3(0.13, 0.05, 0.045);");
  };
}

// One surface in all its states; made by FaceViewer.add.
class FaceSurface {
  constructor(viewer, {name, kind = "skin", triangles, states, colors = null, uv = null,
                       oriented = false}) {
    Object.assign(this, {viewer, name, kind, triangles, positions: [], meshes: [], fields: [],
                         grays: []});
    this.index = new THREE.BufferAttribute(triangles, 1);
    this.shared = {};
    if (colors) this.shared.color = new THREE.BufferAttribute(colors, 3, true);
    if (uv) this.shared.uv = new THREE.BufferAttribute(uv, 2);
    const bone = kind === "bone";
    this.plain = new THREE.MeshStandardMaterial({
      color: colors || uv ? "#ffffff" : bone ? "#f2e8cf" : "#e2b39c", vertexColors: Boolean(colors),
      roughness: bone ? 0.85 : 0.62, metalness: 0, side: THREE.DoubleSide});
    this.colored = new THREE.MeshStandardMaterial({
      map: viewer.rampTexture, roughness: 0.8, metalness: 0, side: THREE.DoubleSide});
    if (oriented) for (const material of [this.plain, this.colored]) darkenInside(material);
    this.style = {visible: true, opacity: 1};
    states.forEach((positions, state) => positions && this.setPositions(state, positions));
  }

  // Gives a state its positions; the array is kept.
  setPositions(state, positions) {
    this.positions[state] = positions;
    if (!this.meshes[state]) this.makeMesh(state, positions);
    const {geometry} = this.meshes[state];
    geometry.attributes.position.array.set(positions);
    geometry.attributes.position.needsUpdate = true;
    geometry.computeVertexNormals();
    geometry.boundingSphere = null;
  }

  clear(state) {
    if (!this.meshes[state]) return;
    this.viewer.three.scene.remove(this.meshes[state]);
    this.meshes[state].geometry.dispose();
    delete this.meshes[state];
    delete this.positions[state];
  }

  makeMesh(state, positions) {
    const geometry = new THREE.BufferGeometry();
    geometry.setIndex(this.index);
    geometry.setAttribute("position", new THREE.BufferAttribute(positions.slice(), 3));
    for (const [name, values] of Object.entries(this.shared)) geometry.setAttribute(name, values);
    const mesh = new THREE.Mesh(geometry, this.plain);
    mesh.userData.surface = this;
    mesh.renderOrder = this.kind === "bone" ? 0 : 1;
    this.meshes[state] = mesh;
    this.viewer.three.scene.add(mesh);
  }

  // Colors a state by a value a vertex, or no longer (null); gray where `gray` is true.
  setField(state, values, gray = null) {
    this.fields[state] = values;
    this.grays[state] = gray;
    const mesh = this.meshes[state];
    if (!mesh) return;
    mesh.material = values ? this.colored : this.plain;
    if (!values) return;
    const {low, high} = this.viewer.scale, uv = new Float32Array(2 * values.length);
    values.forEach((value, i) => {
      uv[2 * i] = Math.min(Math.max((value - low) / (high - low || 1), 0.002), 0.998) || 0;
      uv[2 * i + 1] = Number.isFinite(value) && !gray?.[i] ? 0.25 : 0.75;
    });
    mesh.geometry.setAttribute("uv1", new THREE.BufferAttribute(uv, 2));
  }

  setStyle(style) {
    Object.assign(this.style, style);
    if (style.color) this.plain.color.set(style.color);
    if (style.image) {
      const map = new THREE.Texture(style.image);
      map.colorSpace = THREE.SRGBColorSpace;
      map.needsUpdate = true;
      this.plain.map = map;
    }
    for (const material of [this.plain, this.colored]) {
      material.opacity = this.style.opacity;
      material.transparent = this.style.opacity < 1;
      material.side = material.transparent ? THREE.FrontSide : THREE.DoubleSide;
      material.needsUpdate = true;
    }
  }

  object(state) { return this.meshes[state]; }

  drawIn(state) {
    const visible = this.style.visible && this.style.opacity > 0;
    this.meshes.forEach((mesh, k) => { mesh.visible = visible && k === state; });
  }
}

function makeRenderer() {
  try {
    return new THREE.WebGLRenderer({antialias: true, alpha: true, preserveDrawingBuffer: true});
  } catch (reason) {
    throw new Error(`The view to turn needs a browser with WebGL 2 (${reason.message}).`);
  }
}

class FaceViewer {
  static MIXED = 9;  // the state that mix() fills

  constructor(element, axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) {
    Object.assign(this, {element, axes});
    element.classList.add("face-viewer");
    const renderer = makeRenderer();
    const scene = new THREE.Scene(), camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 1, 4000);
    camera.up.set(...axes[2]);
    element.append(renderer.domElement);
    const controls = new THREE.OrbitControls(camera, renderer.domElement);
    Object.assign(controls, {enableDamping: false, zoomToCursor: true, screenSpacePanning: true});
    this.three = {scene, camera, renderer, controls, THREE};
    this.surfaces = [];
    this.marks = new Map();
    this.shown = {mode: "single", states: [0, 1], split: 0.5};
    this.center = new THREE.Vector3();
    this.radius = 100;
    this.makeLights();
    this.makeRamp();
    this.setScale({ramp: REPOSE_RAMP, low: 0, high: 1});
    this.makeHandle();
    this.listen();
  }

  makeLights() {
    const {scene, camera} = this.three;
    scene.add(new THREE.HemisphereLight("#ffffff", "#b8a8a0", 1.35), camera);
    for (const [strength, ...place] of [[1.55, -0.7, 0.9, 1.4], [0.85, 1.3, 0.1, 0.8]]) {
      const light = new THREE.DirectionalLight("#ffffff", strength);
      light.position.set(...place);
      camera.add(light);
      light.target.position.set(0, 0, -1);
      camera.add(light.target);
    }
  }

  makeRamp() {
    this.rampTexture = new THREE.DataTexture(new Uint8Array(4 * 512), 256, 2);
    this.rampTexture.colorSpace = THREE.SRGBColorSpace;
    this.rampTexture.magFilter = THREE.NearestFilter;
    this.rampTexture.channel = 1;
  }

  setScale(scale) {
    this.scale = {...this.scale, ...scale};
    const {data} = this.rampTexture.image;
    for (let i = 0; i < 256; ++i) {
      data.set([...rampColor(this.scale.ramp, i / 255), 255], 4 * i);
      data.set([168, 172, 178, 255], 4 * (256 + i));
    }
    this.rampTexture.needsUpdate = true;
    for (const surface of this.surfaces)
      surface.fields.forEach((values, state) =>
        values && surface.setField(state, values, surface.grays[state]));
  }

  makeHandle() {
    this.handle = document.createElement("div");
    this.handle.className = "split-handle";
    this.handle.tabIndex = 0;
    this.handle.setAttribute("role", "slider");
    this.handle.setAttribute("aria-label", "boundary between the two faces");
    const move = share => {
      this.show({split: Math.min(Math.max(share, 0.02), 0.98)});
    };
    this.handle.addEventListener("pointerdown", event => {
      this.handle.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    this.handle.addEventListener("pointermove", event => {
      if (!this.handle.hasPointerCapture(event.pointerId)) return;
      const box = this.element.getBoundingClientRect();
      move((event.clientX - box.left) / box.width);
    });
    this.handle.addEventListener("keydown", event => {
      const step = {ArrowLeft: -0.02, ArrowRight: 0.02}[event.key];
      if (step) move(this.shown.split + step);
    });
    this.element.append(this.handle);
  }

  listen() {
    const {renderer: {domElement: canvas}, controls} = this.three;
    controls.addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(this.element);
    let down = null, waiting = null;
    canvas.addEventListener("pointerdown", event => { down = [event.clientX, event.clientY]; });
    canvas.addEventListener("pointerup", event => {
      const still = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5;
      down = null;
      if (!still) return;
      this.onClick?.(this.pick(event), event);
      if (event.pointerType === "touch") this.onHover?.(this.pick(event), event);
    });
    canvas.addEventListener("pointermove", event => {
      if (down || !this.onHover) return;
      if (!waiting) requestAnimationFrame(() => {
        const last = waiting;
        waiting = null;
        this.onHover(this.pick(last), last);
      });
      waiting = event;
    });
    canvas.addEventListener("pointerleave", event => {
      if (event.pointerType !== "touch") this.onHover?.(null, event);  // a finger leaves when it is lifted
    });
  }

  add(described) {
    const surface = new FaceSurface(this, described);
    this.surfaces.push(surface);
    return surface;
  }

  show(shown) {
    Object.assign(this.shown, shown);
    const {mode, split} = this.shown;
    this.handle.hidden = mode !== "split";
    this.handle.style.left = `${100 * split}%`;
    this.handle.setAttribute("aria-valuenow", Math.round(100 * split));
    this.draw();
  }

  mix(one, other, share) {
    for (const surface of this.surfaces) {
      const [a, b] = [surface.positions[one], surface.positions[other]];
      if (!a || !b) {
        surface.clear(FaceViewer.MIXED);
        continue;
      }
      surface.setPositions(FaceViewer.MIXED, a.map((from, i) => from + share * (b[i] - from)));
      const [f, g] = [surface.fields[one], surface.fields[other]];
      surface.setField(FaceViewer.MIXED, g
        ? g.map((to, i) => (f ? f[i] : 0) + share * (to - (f ? f[i] : 0))) : null);
    }
  }

  fit(points) {
    const box = new THREE.Box3().setFromArray(points);
    box.getCenter(this.center);
    this.extent = box.getSize(new THREE.Vector3());
    this.radius = this.extent.length() / 2;
  }

  look(view) {
    const {camera, controls} = this.three;
    const direction = new THREE.Vector3();
    REPOSE_LOOKS[view].forEach((x, a) => direction.addScaledVector(new THREE.Vector3(...this.axes[a]), x));
    direction.normalize();
    camera.position.copy(this.center).addScaledVector(direction, 2000);
    camera.zoom = 1;
    controls.target.copy(this.center);
    controls.update();
    this.draw();
  }

  // Where states are drawn: [{state, left, width: of its viewport, from, to: what of it is shown}].
  panes(width) {
    const {mode, states, split} = this.shown;
    if (mode === "side") {
      const half = Math.floor(width / 2);
      return states.map((state, k) => ({state, left: k * half, width: half, from: k * half,
                                        to: (k + 1) * half}));
    }
    const whole = {left: 0, width};
    if (mode === "split") {
      const middle = Math.round(split * width);
      return [{...whole, state: states[0], from: 0, to: middle},
              {...whole, state: states[1], from: middle, to: width}];
    }
    return [{...whole, state: states[0], from: 0, to: width}];
  }

  aim(width, height) {
    const {camera} = this.three, size = this.extent;
    const tall = 0.55 * (size ? size.z : 2 * this.radius);
    const wide = 0.55 * (size ? Math.max(size.x, size.y) : 2 * this.radius);
    const up = Math.max(tall, wide * height / Math.max(width, 1));
    Object.assign(camera, {top: up, bottom: -up, right: up * width / height,
                           left: -up * width / height});
    camera.updateProjectionMatrix();
  }

  draw() {
    const {renderer, scene, camera} = this.three;
    const width = this.element.clientWidth, height = this.element.clientHeight;
    if (!width || !height || this.busy) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
    if (this.size !== `${width} ${height}`) renderer.setSize(width, height);
    this.size = `${width} ${height}`;
    renderer.setScissorTest(true);
    for (const pane of this.panes(width)) {
      this.aim(pane.width, height);
      renderer.setViewport(pane.left, 0, pane.width, height);
      renderer.setScissor(pane.from, 0, pane.to - pane.from, height);
      for (const surface of this.surfaces) surface.drawIn(pane.state);
      this.drawMarks();
      this.onPane?.(pane, height);
      renderer.render(scene, camera);
    }
    renderer.setScissorTest(false);
  }

  drawMarks() {
    const {camera} = this.three, size = (camera.top - camera.bottom) / camera.zoom / 130;
    for (const group of this.marks.values()) {
      group.visible = true;
      for (const ball of group.children) if (ball.isMesh) ball.scale.setScalar(size);
    }
  }

  pick(event) {
    const box = this.element.getBoundingClientRect(), x = event.clientX - box.left;
    const pane = this.panes(box.width).find(one => x >= one.from && x <= one.to);
    if (!pane) return null;
    const place = new THREE.Vector2(2 * (x - pane.left) / pane.width - 1,
                                    1 - 2 * (event.clientY - box.top) / box.height);
    this.aim(pane.width, box.height);
    const ray = new THREE.Raycaster();
    ray.setFromCamera(place, this.three.camera);
    const drawn = this.surfaces.filter(one => one.style.visible && one.style.opacity > 0)
      .map(one => one.object(pane.state)).filter(Boolean);
    const [hit] = ray.intersectObjects(drawn, false);
    return hit ? this.describe(hit, pane.state) : null;
  }

  describe(hit, state) {
    const surface = hit.object.userData.surface, corners = [hit.face.a, hit.face.b, hit.face.c];
    const local = hit.object.worldToLocal(hit.point.clone());
    const ends = corners.map(corner => new THREE.Vector3().fromBufferAttribute(
      hit.object.geometry.attributes.position, corner));
    const weights = THREE.Triangle.getBarycoord(local, ...ends, new THREE.Vector3());
    const shares = weights ? weights.toArray() : [1, 0, 0];
    const at = (values, size = 1) => Array.from({length: size}, (_, k) =>
      corners.reduce((sum, corner, i) => sum + shares[i] * values[size * corner + k], 0));
    return {surface, state, point: hit.point.toArray(), triangle: corners, weights: shares, at};
  }

  // Small balls at points, joined by a line.
  mark(name, points, color = "#1f6fb4") {
    const {scene} = this.three;
    if (this.marks.has(name)) scene.remove(this.marks.get(name));
    this.marks.delete(name);
    if (points?.length) {
      const group = new THREE.Group(), places = points.map(point => new THREE.Vector3(...point));
      const material = new THREE.MeshBasicMaterial({color, depthTest: false, transparent: true});
      for (const place of places) {
        const ball = new THREE.Mesh(new THREE.SphereGeometry(1, 16, 12), material);
        ball.position.copy(place);
        group.add(ball);
      }
      if (places.length > 1) group.add(new THREE.Line(
        new THREE.BufferGeometry().setFromPoints(places),
        new THREE.LineBasicMaterial({color, depthTest: false, transparent: true})));
      group.children.forEach(child => { child.renderOrder = 5; });
      this.marks.set(name, group);
      scene.add(group);
    }
    this.draw();
  }

  snapshot(width, height, {view = "front", state = 0} = {}) {
    const {renderer, scene, camera, controls} = this.three;
    const kept = {position: camera.position.clone(), zoom: camera.zoom,
                  target: controls.target.clone()};
    this.busy = true;
    this.look(view);
    renderer.setPixelRatio(1);
    renderer.setSize(width, height, false);
    renderer.setViewport(0, 0, width, height);
    this.aim(width, height);
    for (const surface of this.surfaces) surface.drawIn(state);
    for (const group of this.marks.values()) group.visible = false;
    renderer.render(scene, camera);
    const url = renderer.domElement.toDataURL("image/png");
    camera.position.copy(kept.position);
    camera.zoom = kept.zoom;
    controls.target.copy(kept.target);
    this.busy = false;
    this.size = "";
    controls.update();
    this.draw();
    return url;
  }
}
