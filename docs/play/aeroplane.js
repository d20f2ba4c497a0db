// An aeroplane of flat faces, drawn from the back to the front.

import { apply, cross, dot, norm, scaled, unit } from "./vectors.js";

/** Corners; the nose points along x, the right wing along −y, up is z. */
const CORNERS = {
  nose: [1.25, 0, 0], tail: [-1.1, 0, 0.06], top: [0.1, 0, 0.22], belly: [0.1, 0, -0.18], left: [0.1, 0.17, 0], right: [0.1, -0.17, 0],
  wingRoot: [0.45, 0, 0.02], wingBack: [-0.3, 0, 0.02], wingLeft: [-0.35, 1.25, 0.1], wingRight: [-0.35, -1.25, 0.1],
  stabiliser: [-0.7, 0, 0.06], stabiliserLeft: [-1.15, 0.45, 0.1], stabiliserRight: [-1.15, -0.45, 0.1],
  fin: [-0.6, 0, 0.12], finTop: [-1.15, 0, 0.6],
};
/** Faces, with a part of the colour mixed into the paper. */
const FACES = [
  ["nose", "top", "left"], ["nose", "right", "top"], ["nose", "left", "belly"], ["nose", "belly", "right"],
  ["tail", "left", "top"], ["tail", "top", "right"], ["tail", "belly", "left"], ["tail", "right", "belly"],
  ["wingRoot", "wingLeft", "wingBack"], ["wingRoot", "wingBack", "wingRight"],
  ["stabiliser", "stabiliserLeft", "tail"], ["stabiliser", "tail", "stabiliserRight"], ["fin", "finTop", "tail"],
].map((names) => names.map((name) => CORNERS[name]));
/** Towards the light, in the coordinates of the screen. */
const LIGHT = [0.35, 0.75, 0.56];
/** The screen's axes (right, up, to the viewer) of a viewer behind and above, in the axes of the world. */
export const CAMERA = viewer(unit([-0.8, -0.42, 0.43]));

function viewer(direction) {
  const right = unit(cross([0, 0, 1], direction));
  return [...right, ...cross(direction, right), ...direction];
}

export function drawAeroplane(context, rotation, [x, y], size, color, paper) {
  const faces = FACES.map((face) => {
    const corners = face.map((corner) => apply(CAMERA, apply(rotation, corner)));
    const normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    const shade = Math.abs(dot(scaled(normal, 1 / norm(normal)), LIGHT));
    return { corners, shade, depth: corners.reduce((sum, corner) => sum + corner[2], 0) };
  }).sort((a, b) => a.depth - b.depth);
  for (const { corners, shade } of faces) {
    context.beginPath();
    corners.forEach(([cx, cy], i) => context[i ? "lineTo" : "moveTo"](x + size * cx, y - size * cy));
    context.closePath();
    context.fillStyle = paper;
    context.fill();
    context.globalAlpha = 0.35 + 0.6 * shade;
    context.fillStyle = color;
    context.fill();
    context.globalAlpha = 1;
    context.strokeStyle = paper;
    context.lineWidth = 0.8;
    context.stroke();
  }
}

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
