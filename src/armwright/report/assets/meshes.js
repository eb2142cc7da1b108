// Shapes as triangles: corners and their normals, one after the other, three numbers each.

const SIDES = 28;
const HALVES = 7; // rings of half a ball
// Faces that meet at less than this are one round surface.
const ROUND = Math.cos((35 * Math.PI) / 180);

function meshOf(corners, normals, faces) {
  return { corners: Float32Array.from(corners), normals: Float32Array.from(normals), faces: Uint32Array.from(faces) };
}

function boxMesh([x, y, z]) {
  const [corners, normals, faces] = [[], [], []];
  const size = [x / 2, y / 2, z / 2];
  for (let k = 0; k < 3; k++)
    for (const side of [-1, 1]) {
      const first = corners.length / 3;
      for (const [u, v] of [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
      ]) {
        const at = [0, 0, 0];
        [at[k], at[(k + 1) % 3], at[(k + 2) % 3]] = [side, u, v];
        corners.push(...at.map((value, i) => value * size[i]));
        normals.push(...[0, 1, 2].map((i) => (i === k ? side : 0)));
      }
      faces.push(...(side > 0 ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2]).map((i) => first + i));
    }
  return meshOf(corners, normals, faces);
}

// A surface of revolution about z: rings of [radius, height, radial part of the normal, its part along z], upwards.
function roundMesh(rings) {
  const [corners, normals, faces] = [[], [], []];
  for (const [radius, height, out, along] of rings)
    for (let i = 0; i <= SIDES; i++) {
      const [c, s] = [Math.cos((2 * Math.PI * i) / SIDES), Math.sin((2 * Math.PI * i) / SIDES)];
      corners.push(radius * c, radius * s, height);
      normals.push(out * c, out * s, along);
    }
  const wide = SIDES + 1;
  for (let j = 0; j + 1 < rings.length; j++)
    for (let i = 0; i < SIDES; i++) {
      const [a, b] = [j * wide + i, (j + 1) * wide + i];
      faces.push(a, a + 1, b + 1, a, b + 1, b);
    }
  return meshOf(corners, normals, faces);
}

function cylinderMesh(r, length) {
  const h = length / 2;
  return roundMesh([
    [0, -h, 0, -1],
    [r, -h, 0, -1],
    [r, -h, 1, 0],
    [r, h, 1, 0],
    [r, h, 0, 1],
    [0, h, 0, 1],
  ]);
}

function capsuleMesh(r, length) {
  const rings = [];
  for (const side of [-1, 1])
    for (let k = 0; k <= HALVES; k++) {
      const angle = ((side < 0 ? k - HALVES : k) * Math.PI) / 2 / HALVES;
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      rings.push([r * c, r * s + (side * length) / 2, c, s]);
    }
  return roundMesh(rings);
}

// Corners of a mesh are shared only by faces that are round there.
function facetMesh(vertices, faces) {
  const triples = (list, i) => [list[3 * i], list[3 * i + 1], list[3 * i + 2]];
  const count = faces.length / 3;
  const areas = Array.from({ length: count }, (_, f) => {
    const [a, b, c] = triples(faces, f).map((v) => triples(vertices, v));
    return cross(plus(b, a, -1), plus(c, a, -1));
  });
  const units = areas.map(unit);
  const around = new Map();
  faces.forEach((v, i) => around.set(v, [...(around.get(v) ?? []), Math.floor(i / 3)]));
  const [corners, normals] = [[], []];
  faces.forEach((v, i) => {
    const own = units[Math.floor(i / 3)];
    const near = around.get(v).filter((f) => dot(units[f], own) > ROUND);
    corners.push(...triples(vertices, v));
    normals.push(...unit(near.reduce((sum, f) => plus(sum, areas[f]), [0, 0, 0])));
  });
  return meshOf(
    corners,
    normals,
    faces.map((_, i) => i),
  );
}

function shapeMesh(shape) {
  if (shape.kind === "box") return boxMesh(shape.size);
  if (shape.kind === "cylinder") return cylinderMesh(shape.radius, shape.length);
  if (shape.kind === "capsule") return capsuleMesh(shape.radius, shape.length);
  if (shape.kind === "sphere") return capsuleMesh(shape.radius, 0);
  return facetMesh(shape.vertices, shape.faces);
}

const meshes = (data.animation?.shapes ?? []).map(shapeMesh);
