"use strict";
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const canvas = document.getElementById("view");
  const note = document.getElementById("view-note");
  const gl = canvas.getContext("webgl", { antialias: true, alpha: true });
  if (!gl) {
    note.textContent = "This browser has no WebGL: see view.svg, and boundary.stl in any CAD program.";
    return;
  }
  const count = data.triangles.length;
  const positions = new Float32Array(3 * count), normals = new Float32Array(3 * count);
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < count; i++) {
    for (let k = 0; k < 3; k++) {
      const value = data.vertices[3 * data.triangles[i] + k];
      positions[3 * i + k] = value;
      low[k] = Math.min(low[k], value);
      high[k] = Math.max(high[k], value);
    }
  }
  for (let i = 0; i < 3 * count; i += 9) {
    const p = positions, u = [0, 1, 2].map(k => p[i + 3 + k] - p[i + k]), v = [0, 1, 2].map(k => p[i + 6 + k] - p[i + k]);
    const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const length = Math.hypot(n[0], n[1], n[2]) || 1;
    for (let j = 0; j < 9; j++) normals[i + j] = n[j % 3] / length;
  }
  const centre = low.map((l, k) => (l + high[k]) / 2);
  const size = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / 2;

  function shader(type, text) {
    const made = gl.createShader(type);
    gl.shaderSource(made, text);
    gl.compileShader(made);
    return made;
  }
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    attribute vec3 place, normal, colour;
    uniform mat3 turn; uniform vec3 centre; uniform vec2 scale;
    varying vec3 seen, shade, at;
    void main() {
      vec3 p = turn * (place - centre);
      seen = turn * normal; shade = colour; at = place;
      gl_Position = vec4(p.x * scale.x, p.y * scale.y, -p.z * 0.3 * min(scale.x, scale.y), 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    precision mediump float;
    varying vec3 seen, shade, at;
    uniform float cut, lit;
    void main() {
      if (at.y < cut) discard;
      float light = mix(1.0, 0.4 + 0.6 * abs(dot(normalize(seen), normalize(vec3(-0.4, 0.5, 0.8)))), lit);
      gl_FragColor = vec4(shade * light * (gl_FrontFacing || lit < 0.5 ? 1.0 : 0.6), 1.0);
    }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  const where = name => gl.getAttribLocation(program, name), uniform = name => gl.getUniformLocation(program, name);
  function buffer(values) {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    return made;
  }
  function use(name, values) {
    gl.bindBuffer(gl.ARRAY_BUFFER, values);
    gl.enableVertexAttribArray(where(name));
    gl.vertexAttribPointer(where(name), 3, gl.FLOAT, false, 0, 0);
  }
  const rgb = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16) / 255);
  const faces = { place: buffer(positions), normal: buffer(normals) };
  const colours = data.modes.map(mode => {
    const palette = mode.classes.map(c => rgb(c.colour)), values = new Float32Array(3 * count);
    for (let i = 0; i < count; i++) values.set(palette[mode.values[mode.of_triangles ? Math.floor(i / 3) : data.triangles[i]]], 3 * i);
    return buffer(values);
  });
  const lines = new Float32Array(data.lines), ink = new Float32Array(lines.length).fill(0.5);
  const frame = { place: buffer(lines), normal: buffer(ink), colour: buffer(ink) };

  let yaw = 0.6, pitch = 0.3, zoom = 1, mode = 0, waiting = false;
  const cut = document.getElementById("cut"), choice = document.getElementById("mode"), legend = document.getElementById("legend");
  cut.min = low[1]; cut.max = high[1]; cut.step = (high[1] - low[1]) / 200; cut.value = low[1];
  data.modes.forEach((m, i) => choice.add(new Option(m.name, i)));

  function draw() {
    waiting = false;
    const ratio = window.devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const s = Math.sin(yaw), c = Math.cos(yaw), sp = Math.sin(pitch), cp = Math.cos(pitch);
    const right = [c, -s, 0], up = [s * sp, c * sp, cp], out = [-s * cp, -c * cp, sp];
    gl.uniformMatrix3fv(uniform("turn"), false, [0, 1, 2].flatMap(k => [right[k], up[k], out[k]]));
    gl.uniform3fv(uniform("centre"), centre);
    const least = Math.min(canvas.width, canvas.height);
    gl.uniform2f(uniform("scale"), zoom / size * least / canvas.width, zoom / size * least / canvas.height);
    gl.uniform1f(uniform("cut"), Number(cut.value) - 1e-3 * size);
    gl.uniform1f(uniform("lit"), 1);
    use("place", faces.place); use("normal", faces.normal); use("colour", colours[mode]);
    gl.drawArrays(gl.TRIANGLES, 0, count);
    gl.uniform1f(uniform("cut"), -1e9);
    gl.uniform1f(uniform("lit"), 0);
    use("place", frame.place); use("normal", frame.normal); use("colour", frame.colour);
    gl.drawArrays(gl.LINES, 0, lines.length / 3);
  }
  function again() {
    if (!waiting) { waiting = true; requestAnimationFrame(draw); }
  }
  function choose() {
    mode = Number(choice.value);
    legend.replaceChildren(...data.modes[mode].classes.map(c => {
      const entry = document.createElement("span"), key = document.createElement("i");
      key.style.background = c.colour;
      entry.append(key, c.name);
      return entry;
    }));
    again();
  }
  const fingers = new Map();
  let spread = 0;
  canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, e); });
  canvas.addEventListener("pointermove", e => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    fingers.set(e.pointerId, e);
    if (fingers.size === 1) {
      yaw += (e.clientX - before.clientX) * 0.01;
      pitch = Math.max(-1.57, Math.min(1.57, pitch + (e.clientY - before.clientY) * 0.01));
    } else {
      const [a, b] = [...fingers.values()], now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
      if (spread > 0) zoom *= now / spread;
      spread = now;
    }
    again();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => { fingers.delete(e.pointerId); spread = 0; });
  canvas.addEventListener("wheel", e => { e.preventDefault(); zoom *= Math.exp(-e.deltaY * 0.001); again(); }, { passive: false });
  canvas.addEventListener("keydown", e => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
    if (e.key === "+") zoom *= 1.1;
    else if (e.key === "-") zoom /= 1.1;
    else if (step) { yaw += step[0]; pitch += step[1]; }
    else return;
    e.preventDefault();
    again();
  });
  cut.addEventListener("input", again);
  choice.addEventListener("change", choose);
  window.addEventListener("resize", again);
  choose();
})();
