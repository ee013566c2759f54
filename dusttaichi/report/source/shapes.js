// Spheres and rods as instanced quads that the fragment shader makes round: two triangles each.
// The camera looks in parallel projection along -z of its space.

import {
  DoubleSide, DynamicDrawUsage, GLSL3, InstancedBufferAttribute, InstancedBufferGeometry,
  Float32BufferAttribute, Mesh, ShaderMaterial, Vector4,
} from "three";

const LIGHT = `
  vec3 lit(vec3 tint, vec3 normal) {
    float front = max(dot(normal, normalize(vec3(0.35, 0.55, 1.0))), 0.0);
    return tint * (0.34 + 0.70 * front) + vec3(0.10 * pow(front, 24.0));
  }`;

const SPHERE_VERTEX = `
  in vec3 centre; in float radius; in vec4 tint;
  out vec2 spot; out vec3 middle; out float size; out vec3 shade;
  void main() {
    spot = position.xy; size = radius; shade = tint.rgb;
    middle = (modelViewMatrix * vec4(centre, 1.0)).xyz;
    gl_Position = projectionMatrix * vec4(middle.xy + spot * radius, middle.z, 1.0);
  }`;

// a rim that is lighter sets the darkest spheres off from a dark page;
// where the plane cuts a sphere open, the ray goes on to the plane: the cut has the colour of the
// sphere, without light and shade, and a darker rim that tells one cut sphere from the next
const SPHERE_FRAGMENT = `
  uniform mat4 projectionMatrix; uniform vec4 plane; uniform bool cut; uniform float rim;
  in vec2 spot; in vec3 middle; in float size; in vec3 shade;
  out vec4 colour;
  ${LIGHT}
  void main() {
    float q = dot(spot, spot);
    if (q > 1.0) discard;
    vec3 normal = vec3(spot, sqrt(1.0 - q));
    vec3 p = middle + size * normal;
    vec3 shown = lit(shade, normal) + rim * smoothstep(0.78, 1.0, q);
    if (cut && dot(plane.xyz, p) > plane.w) {
      float way = (dot(plane.xyz, p) - plane.w) / plane.z;
      if (plane.z < 1e-6 || way > 2.0 * size * normal.z) discard;
      p.z -= way;
      float edge = smoothstep(0.86, 0.98, distance(p, middle) / size);
      shown = shade * (1.0 - 0.4 * edge) + 2.0 * rim * edge;
    }
    colour = vec4(shown, 1.0);
    gl_FragDepth = 0.5 * (projectionMatrix[2][2] * p.z + projectionMatrix[3][2]) + 0.5;
  }`;

const ROD_VERTEX = `
  in vec3 from; in vec3 to; in float width; in vec4 tint;
  out float across; out vec3 place; out vec3 shade;
  void main() {
    vec3 a = (modelViewMatrix * vec4(from, 1.0)).xyz;
    vec3 b = (modelViewMatrix * vec4(to, 1.0)).xyz;
    vec2 along = b.xy - a.xy;
    vec2 side = length(along) > 0.0 ? normalize(vec2(-along.y, along.x)) : vec2(1.0, 0.0);
    across = position.x; shade = tint.rgb;
    place = mix(a, b, 0.5 * (position.y + 1.0)) + vec3(side * position.x * width, 0.0);
    gl_Position = projectionMatrix * vec4(place, 1.0);
  }`;

const ROD_FRAGMENT = `
  uniform vec4 plane; uniform bool cut;
  in float across; in vec3 place; in vec3 shade;
  out vec4 colour;
  ${LIGHT}
  void main() {
    if (cut && dot(plane.xyz, place) > plane.w) discard;
    colour = vec4(lit(shade, vec3(0.0, across, sqrt(max(1.0 - across * across, 0.0)))), 1.0);
  }`;

class Instances extends Mesh {
  constructor(attributes, vertexShader, fragmentShader, room) {
    const geometry = new InstancedBufferGeometry();
    const corners = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0];
    geometry.setAttribute("position", new Float32BufferAttribute(corners, 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    for (const [name, width] of Object.entries(attributes)) {
      const colour = name === "tint"; // three bytes and one that fills up
      const array = colour ? new Uint8Array(4 * room) : new Float32Array(room * width);
      const values = new InstancedBufferAttribute(array, colour ? 4 : width, colour);
      geometry.setAttribute(name, values.setUsage(DynamicDrawUsage));
    }
    const uniforms = { plane: { value: new Vector4() }, cut: { value: false }, rim: { value: 0 } };
    super(
      geometry,
      new ShaderMaterial({
        vertexShader, fragmentShader, uniforms, glslVersion: GLSL3, side: DoubleSide,
      }),
    );
    this.frustumCulled = false;
    this.uniforms = uniforms;
    this.show(0);
  }

  // the numbers of an attribute, colours as one each
  array(name) {
    const { array } = this.geometry.getAttribute(name);
    return name === "tint" ? new Uint32Array(array.buffer) : array;
  }

  // write(array) sets the numbers of one attribute, which then go to the graphics card
  fill(name, write) {
    write(this.array(name));
    this.geometry.getAttribute(name).needsUpdate = true;
  }

  show(count, ...changed) {
    this.geometry.instanceCount = count;
    for (const name of changed) this.geometry.getAttribute(name).needsUpdate = true;
  }
}

export const spheres = (room) =>
  new Instances({ centre: 3, radius: 1, tint: 3 }, SPHERE_VERTEX, SPHERE_FRAGMENT, room);

export const rods = (room) =>
  new Instances({ from: 3, to: 3, width: 1, tint: 3 }, ROD_VERTEX, ROD_FRAGMENT, room);
