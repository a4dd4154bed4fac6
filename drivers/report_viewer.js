// The interactive view of report.py: drag to turn, Shift and drag to shift, wheel to zoom. WebGL 2.
"use strict";
(() => {
  const control = id => document.getElementById(id);
  const canvas = control("view"), data = JSON.parse(control("meshes").textContent);
  const gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
  if (!gl) { control("no-view").hidden = false; canvas.hidden = true; return; }
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const vertexSource = `#version 300 es
    in vec3 p0, p1, n0, n1;
    uniform mat4 camera; uniform mat3 turn; uniform float share, largest;
    out vec3 normal; out float moved;
    void main() {
      normal = turn * mix(n0, n1, share);
      moved = largest > 0.0 ? share * distance(p0, p1) / largest : -1.0;
      gl_Position = camera * vec4(mix(p0, p1, share), 1);
    }`;
  const fragmentSource = `#version 300 es
    precision highp float;
    in vec3 normal; in float moved;
    uniform vec3 colour; uniform float opacity; uniform vec3 scale[5];
    out vec4 pixel;
    void main() {
      vec3 base = colour;
      if (moved >= 0.0) {
        float place = clamp(moved, 0.0, 1.0) * 4.0;
        int below = min(int(place), 3);
        base = mix(scale[below], scale[below + 1], place - float(below));
      }
      float light = abs(dot(normalize(normal), normalize(vec3(-0.35, 0.45, 1.0))));
      pixel = vec4(base * (0.3 + 0.75 * light), 1) * opacity;
    }`;
  const program = gl.createProgram();
  const sources = [[gl.VERTEX_SHADER, vertexSource], [gl.FRAGMENT_SHADER, fragmentSource]];
  for (const [kind, source] of sources) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = name => gl.getUniformLocation(program, name);
  // Normals of the vertices, weighted by area.
  function normals(points, corners) {
    const sum = new Float32Array(points.length);
    for (let t = 0; t < corners.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map(k => 3 * corners[t + k]);
      const [u, v] = [b, c].map(end => [0, 1, 2].map(k => points[end + k] - points[a + k]));
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const corner of [a, b, c]) for (let k = 0; k < 3; ++k) sum[corner + k] += n[k];
    }
    return sum;
  }
  function mesh(stored) {
    const [p0, p1] = [stored.before, stored.after].map(text => Float32Array.from(
      new Uint16Array(bytes(text)), (whole, i) => stored.low[i % 3] + stored.step * whole));
    const corners = new Uint32Array(bytes(stored.triangles)), array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const attributes = {p0, p1, n0: normals(p0, corners), n1: normals(p1, corners)};
    for (const [name, values] of Object.entries(attributes)) {
      const place = gl.getAttribLocation(program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    return {array, count: corners.length};
  }
  const skin = mesh(data.skin), bones = data.bones.map(mesh);
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.uniform3fv(uniform("scale"), data.scale.flat());

  const view = {around: 0.6, up: 0.1, zoom: 1, x: 0, y: 0};
  function rows() {  // right, up and towards the eye, of a head that looks to −y with +z up
    const [s, t] = [Math.sin(view.around), Math.sin(view.up)];
    const [c, d] = [Math.cos(view.around), Math.cos(view.up)];
    return [[c, s, 0], [s * t, -c * t, d], [s * d, -c * d, t]];
  }
  function draw_mesh(one, colour, largest, opacity) {
    gl.bindVertexArray(one.array);
    gl.uniform3fv(uniform("colour"), colour);
    gl.uniform1f(uniform("largest"), largest);
    gl.uniform1f(uniform("opacity"), opacity);
    gl.drawElements(gl.TRIANGLES, one.count, gl.UNSIGNED_INT, 0);
  }
  function draw() {
    const ratio = window.devicePixelRatio || 1;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [r, u, e] = rows(), [x, y, z] = data.middle;
    const along = axis => -(axis[0] * x + axis[1] * y + axis[2] * z);
    const sy = view.zoom / data.radius, sz = -0.25 / data.radius;
    const sx = sy * canvas.height / canvas.width;
    const turned = [0, 1, 2].flatMap(k => [sx * r[k], sy * u[k], sz * e[k], 0]);
    const shift = [sx * along(r) + view.x, sy * along(u) + view.y, sz * along(e), 1];
    gl.uniformMatrix4fv(uniform("camera"), false, turned.concat(shift));
    gl.uniformMatrix3fv(uniform("turn"), false, [0, 1, 2].flatMap(k => [r[k], u[k], e[k]]));
    gl.uniform1f(uniform("share"), control("share").value);
    const opacity = Number(control("opacity").value);
    gl.disable(gl.BLEND);
    if (control("bones").checked)
      for (const bone of bones) draw_mesh(bone, [0.96, 0.92, 0.8], 0, 1);
    if (opacity < 1) {  // what is nearest only
      gl.enable(gl.BLEND);
      gl.colorMask(false, false, false, false);
      draw_mesh(skin, [0, 0, 0], 0, 1);
      gl.colorMask(true, true, true, true);
      gl.depthFunc(gl.EQUAL);
    }
    const largest = control("coloured").checked ? data.largest : 0;
    if (opacity > 0) draw_mesh(skin, [0.87, 0.68, 0.58], largest, opacity);
    gl.depthFunc(gl.LESS);
  }

  canvas.addEventListener("pointermove", event => {
    if (!event.buttons) return;
    if (event.buttons === 2 || event.shiftKey) {
      view.x += 2 * event.movementX / canvas.clientWidth;
      view.y -= 2 * event.movementY / canvas.clientHeight;
    } else {
      view.around -= 0.01 * event.movementX;
      view.up = Math.max(-1.5, Math.min(1.5, view.up + 0.01 * event.movementY));
    }
    draw();
  });
  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    view.zoom *= Math.exp(-0.001 * event.deltaY);
    draw();
  }, {passive: false});
  for (const button of document.querySelectorAll("[data-around]"))
    button.addEventListener("click", () => {
      Object.assign(view, {around: Number(button.dataset.around), up: 0, x: 0, y: 0, zoom: 1});
      draw();
    });
  for (const id of ["share", "opacity", "bones", "coloured"])
    control(id).addEventListener("input", draw);
  window.addEventListener("resize", draw);
  draw();
})();
