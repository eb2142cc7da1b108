// Bodies drawn by the graphics processor, where there is a fast one: smooth edges, light at every pixel, soft shadows of
// a sun that stands above. Otherwise the surface paints them.

const VERTEX = `#version 300 es
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 normal;
uniform mat4 pose, eye, sun;
out vec3 side, fromSun;
void main() {
  vec4 p = pose * vec4(corner, 1.0);
  side = mat3(pose) * normal;
  fromSun = (sun * p).xyz * 0.5 + 0.5;
  gl_Position = eye * p;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
uniform vec3 colour, light;
uniform float shadowOnly;
uniform sampler2DShadow above;
in vec3 side, fromSun;
out vec4 paint;
float lit() {
  if (any(lessThan(fromSun, vec3(0.0))) || any(greaterThan(fromSun, vec3(1.0)))) return 1.0;
  float sum = 0.0;
  for (int i = 0; i < 9; i++)
    sum += texture(above, fromSun + vec3(vec2(i % 3 - 1, i / 3 - 1) / 1400.0, -0.002));
  return sum / 9.0;
}
void main() {
  if (shadowOnly > 0.5) {
    paint = vec4(0.0, 0.0, 0.0, 0.2 * (1.0 - lit()));
    return;
  }
  vec3 n = normalize(side);
  float bright = clamp(0.38 + 0.55 * dot(n, light), 0.0, 1.0);
  vec3 seen = bright < 0.62 ? colour * (0.42 + 0.58 * bright / 0.62) : mix(colour, vec3(1.0), (bright - 0.62) * 0.9);
  paint = vec4(seen * mix(1.0, 0.74 + 0.26 * lit(), smoothstep(0.2, 0.6, n.z)), 1.0);
}`;
const NOTHING = `#version 300 es
precision mediump float;
void main() {}`;
const SHADOW_SIZE = 2048;
const MOST_GL_PIXELS = 6e6;

function programOf(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
  const at = (name) => gl.getUniformLocation(program, name);
  const names = ["pose", "eye", "sun", "colour", "light", "shadowOnly"];
  return { program, ...Object.fromEntries(names.map((name) => [name, at(name)])) };
}

function uploadedMesh(gl, { corners, normals, faces }) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  for (const [k, values] of [corners, normals].entries()) {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 0, 0);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
  return { array, count: faces.length };
}

// What is higher than anything else, seen from above.
function shadowMap(gl) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
  for (const [key, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR],
    [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE],
  ])
    gl.texParameteri(gl.TEXTURE_2D, key, value);
  const target = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
  gl.drawBuffers([gl.NONE]);
  return target;
}

// Null without a graphics processor; software that takes its place is slower than the surface.
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

function startGraphics() {
  const canvas = document.createElement("canvas");
  const gl = canvas.getContext("webgl2", { antialias: true, failIfMajorPerformanceCaveat: true });
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  if (!gl || SOFTWARE.test(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER))) return null;
  const [seen, shade] = [programOf(gl, VERTEX, FRAGMENT), programOf(gl, VERTEX, NOTHING)];
  if (!seen || !shade) return null;
  canvas.addEventListener("webglcontextlost", () => {
    graphics = null;
    drawView();
  });
  const solids = meshes.map((mesh) => uploadedMesh(gl, mesh));
  const floor = uploadedMesh(gl, boxMesh([1, 1, 0]));
  return { canvas, gl, seen, shade, solids, floor, map: shadowMap(gl) };
}

// Columns of a matrix for the processor from twelve numbers.
const matrixOf = (X) => [...X.slice(0, 3), 0, ...X.slice(3, 6), 0, ...X.slice(6, 9), 0, ...X.slice(9), 1];

function eyeMatrix(width, height) {
  const [near, far] = [0.02 * camera.distance, 40 * camera.distance];
  const [wide, high] = [(2 * lens.focal) / width, (2 * lens.focal) / height];
  const { right, up, forward, eye } = lens;
  const rows = [
    [...right.map((v) => wide * v), -wide * dot(right, eye)],
    [...up.map((v) => high * v), -high * dot(up, eye)],
    null,
    [...forward, -dot(forward, eye)],
  ];
  const [slope, level] = [(far + near) / (far - near), (-2 * far * near) / (far - near)];
  rows[2] = rows[3].map((v, k) => slope * v + (k === 3 ? level : 0));
  return [0, 1, 2, 3].flatMap((column) => rows.map((row) => row[column]));
}

function sunMatrix() {
  const margin = 0.3 * scenery.size;
  const [low, high] = [scenery.low.map((v) => v - margin), scenery.high.map((v) => v + margin)];
  const scale = [0, 1, 2].map((k) => (k < 2 ? 2 : -2) / (high[k] - low[k]));
  const shift = [0, 1, 2].map((k) => (-scale[k] * (high[k] + low[k])) / 2);
  return [scale[0], 0, 0, 0, 0, scale[1], 0, 0, 0, 0, scale[2], 0, ...shift, 1];
}

function drawSolids(program, bodies) {
  const { gl, solids } = graphics;
  for (const body of bodies) {
    gl.uniformMatrix4fv(program.pose, false, matrixOf(body.pose));
    if (program.colour) gl.uniform3fv(program.colour, channels(tintOf(body)).map((v) => v / 255));
    gl.bindVertexArray(solids[body.shape].array);
    gl.drawElements(gl.TRIANGLES, solids[body.shape].count, gl.UNSIGNED_INT, 0);
  }
}

function drawFloorShadow() {
  const { gl, seen, floor } = graphics;
  if (lens.eye[2] <= scenery.floor) return;
  const wide = 3 * scenery.size;
  gl.uniformMatrix4fv(seen.pose, false, matrixOf([wide, 0, 0, 0, wide, 0, 0, 0, 1, ...scenery.middle.slice(0, 2), scenery.floor]));
  gl.uniform1f(seen.shadowOnly, 1);
  gl.depthMask(false);
  gl.bindVertexArray(floor.array);
  gl.drawElements(gl.TRIANGLES, floor.count, gl.UNSIGNED_INT, 0);
  gl.depthMask(true);
  gl.uniform1f(seen.shadowOnly, 0);
}

function drawGraphics(bodies, width, height) {
  const { canvas, gl, seen, shade, map } = graphics;
  const ratio = Math.min(FINEST * (window.devicePixelRatio || 1), Math.sqrt(MOST_GL_PIXELS / (width * height)));
  const [wide, high] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  const sun = sunMatrix();
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.CULL_FACE);
  gl.clearColor(0, 0, 0, 0);

  gl.bindFramebuffer(gl.FRAMEBUFFER, map);
  gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
  gl.clear(gl.DEPTH_BUFFER_BIT);
  gl.useProgram(shade.program);
  gl.uniformMatrix4fv(shade.eye, false, sun);
  // The undersides of bodies cast the shadows, so that no surface lies in its own.
  gl.frontFace(gl.CW);
  drawSolids(shade, bodies);
  gl.frontFace(gl.CCW);

  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.viewport(0, 0, wide, high);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.useProgram(seen.program);
  gl.uniformMatrix4fv(seen.eye, false, eyeMatrix(width, height));
  gl.uniformMatrix4fv(seen.sun, false, sun);
  gl.uniform3fv(seen.light, lightOf());
  drawFloorShadow();
  drawSolids(seen, bodies);
  pen.imageSmoothingQuality = "high";
  pen.drawImage(canvas, 0, 0, width, height);
}

let graphics = startGraphics();
