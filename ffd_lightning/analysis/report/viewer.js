// Meshes that can be turned, all together, in WebGL 2 and nothing else. One context draws for all
// canvases, since browsers allow only some sixteen; each canvas receives a copy of its picture. It
// covers a still picture, which remains where nothing can be drawn.
"use strict";
(() => {
  const canvases = [...document.querySelectorAll("canvas[data-mesh]")];
  if (!canvases.length) return;
  const packed = JSON.parse(document.getElementById("meshes").textContent);
  const stage = document.createElement("canvas");
  const gl = stage.getContext("webgl2");
  if (!gl) return;

  const HALF_VIEW = Math.PI / 9; // the renderer's field of view is 40 degrees
  const DISTANCE = 0.5 / Math.sin(HALF_VIEW);
  const COLORS = [[0.36, 0.62, 0.93], [0.78, 0.77, 0.74]];
  const VERTEX = `#version 300 es
    in vec3 place;
    uniform float scale;
    uniform vec2 focal;
    uniform mat3 toCamera;
    out vec3 seen;
    void main() {
      seen = toCamera * (place * scale);
      float depth = ${DISTANCE} - seen.z;
      // Nearest and farthest depth drawn: 0.05 and 100.
      gl_Position = vec4(focal * seen.xy, (100.05 * depth - 10.0) / 99.95, depth);
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec3 seen;
    uniform vec3 color;
    out vec4 result;
    void main() {
      // One normal per face, turned toward the eye: meshes may be open and wound either way.
      vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
      float light = 0.42 + 0.4 * max(dot(normal, normalize(vec3(-0.35, 0.75, 0.55))), 0.0)
        + 0.25 * abs(normal.z);
      result = vec4(color * light, 1.0);
    }`;
  const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

  let uniforms = {};
  let buffers = new Map();

  function compile(program, type, source) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }

  function setUp() {
    const program = gl.createProgram();
    compile(program, gl.VERTEX_SHADER, VERTEX);
    compile(program, gl.FRAGMENT_SHADER, FRAGMENT);
    gl.bindAttribLocation(program, 0, "place");
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    uniforms = {};
    for (const name of ["scale", "focal", "toCamera", "color"])
      uniforms[name] = gl.getUniformLocation(program, name);
    buffers = new Map();
  }

  function upload(name) {
    if (buffers.has(name)) return buffers.get(name);
    const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const { vertices, faces, scale } = packed[name];
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, bytes(vertices), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.SHORT, true, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    const indices = bytes(faces);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    buffers.set(name, { array, scale, count: indices.length / 2 });
    return buffers.get(name);
  }

  // The camera's axes as columns of a matrix from the model's frame: see imaging/camera.py.
  function axes(azimuth, elevation) {
    const [sa, ca] = [Math.sin(azimuth), Math.cos(azimuth)];
    const [se, ce] = [Math.sin(elevation), Math.cos(elevation)];
    const toward = [sa * ce, se, -ca * ce];
    const right = [-ca, 0, -sa];
    const up = [
      toward[1] * right[2] - toward[2] * right[1],
      toward[2] * right[0] - toward[0] * right[2],
      toward[0] * right[1] - toward[1] * right[0],
    ];
    return [0, 1, 2].flatMap((k) => [right[k], up[k], toward[k]]);
  }

  function draw(view) {
    const { canvas } = view;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height)
      [canvas.width, canvas.height] = [width, height];
    if (stage.width !== width || stage.height !== height)
      [stage.width, stage.height] = [width, height];
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const mesh = upload(canvas.dataset.mesh);
    const aspect = width / height;
    const focal = (view.zoom * Math.min(1, aspect)) / Math.tan(HALF_VIEW);
    gl.uniformMatrix3fv(uniforms.toCamera, false, axes(view.azimuth, view.elevation));
    gl.uniform2f(uniforms.focal, focal / aspect, focal);
    gl.viewport(0, 0, width, height);
    gl.uniform3fv(uniforms.color, COLORS["true" in canvas.dataset ? 1 : 0]);
    // A prediction that has grown out of the frame is shown whole, and the row beside it as small.
    gl.uniform1f(uniforms.scale, mesh.scale * canvas.dataset.fit);
    gl.bindVertexArray(mesh.array);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
    view.paper.clearRect(0, 0, width, height);
    view.paper.drawImage(stage, 0, 0);
    canvas.parentElement.classList.add("live");
  }

  const waiting = new Set();
  function redraw(view) {
    if (!view.visible) return;
    if (!waiting.size)
      requestAnimationFrame(() => {
        waiting.forEach(draw);
        waiting.clear();
      });
    waiting.add(view);
  }

  // Whichever is taken hold of, all turn: the same shape is compared from the same side.
  function turn(right, up) {
    for (const view of views.values()) {
      view.azimuth += right;
      view.elevation = clamp(view.elevation + up, -Math.PI / 2, Math.PI / 2);
      redraw(view);
    }
  }

  function zoom(factor) {
    for (const view of views.values()) {
      view.zoom = clamp(view.zoom * factor, 0.4, 8);
      redraw(view);
    }
  }

  function reset(view) {
    const degrees = Math.PI / 180;
    view.azimuth = view.canvas.dataset.azimuth * degrees;
    view.elevation = view.canvas.dataset.elevation * degrees;
    view.zoom = 1;
    redraw(view);
  }

  function listen(view) {
    const { canvas } = view;
    const pointers = new Map();
    const spread = () => {
      const [a, b] = [...pointers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const held = event.pointerType !== "touch";
      pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, held });
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return;
      const before = pointers.size === 2 ? spread() : 0;
      const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
      if (!last.held && pointers.size === 1) {
        // A finger that sets out up or down scrolls the page: the mesh must not tilt meanwhile.
        if (Math.hypot(dx, dy) < 8) return;
        if (Math.abs(dy) > Math.abs(dx)) {
          pointers.delete(event.pointerId);
          return;
        }
      }
      last.held = true;
      [last.x, last.y] = [event.clientX, event.clientY];
      const angle = 3 / canvas.clientHeight / pointers.size;
      turn(dx * angle, dy * angle);
      if (before > 0) zoom(spread() / before);
    });
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
    canvas.addEventListener(
      "wheel",
      (event) => {
        // The page must scroll past a picture that nobody has taken hold of.
        if (document.activeElement !== canvas && !event.ctrlKey) return;
        event.preventDefault();
        zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.002)));
      },
      { passive: false },
    );
    canvas.addEventListener("dblclick", () => views.forEach(reset));
    const keys = {
      ArrowLeft: () => turn(-0.15, 0),
      ArrowRight: () => turn(0.15, 0),
      ArrowUp: () => turn(0, -0.15),
      ArrowDown: () => turn(0, 0.15),
      "+": () => zoom(1.2),
      "=": () => zoom(1.2),
      "-": () => zoom(1 / 1.2),
      0: () => views.forEach(reset),
    };
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  }

  const views = new Map();
  setUp();
  for (const canvas of canvases) {
    const view = { canvas, paper: canvas.getContext("2d"), visible: false };
    views.set(canvas, view);
    reset(view);
    listen(view);
  }
  const seen = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) {
        views.get(target).visible = isIntersecting;
        redraw(views.get(target));
      }
    },
    { rootMargin: "300px" },
  );
  const resized = new ResizeObserver((entries) =>
    entries.forEach(({ target }) => redraw(views.get(target))),
  );
  for (const canvas of canvases) {
    seen.observe(canvas);
    resized.observe(canvas);
  }
  document.documentElement.classList.add("turning");
  stage.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    for (const canvas of canvases) canvas.parentElement.classList.remove("live");
  });
  stage.addEventListener("webglcontextrestored", () => {
    setUp();
    views.forEach(redraw);
  });
})();
