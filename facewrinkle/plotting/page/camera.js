// A camera that turns about the point that it looks at.

const { sin, cos, tan, hypot, max, min, PI } = Math;
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
/** A place mirrored in the plane through a point, across a direction. */
export const mirrored = (place, origin, across) => add(place, across, -2 * dot(add(place, origin, -1), across));
export const unit = (a) => { const l = hypot(...a) || 1; return [a[0] / l, a[1] / l, a[2] / l]; };

export class Camera {
  constructor(axes, size, angle, extent) {
    Object.assign(this, { axes, size, angle: (angle * PI) / 180, extent });
    this.yaw = 0; this.pitch = 0; this.focus = [0, 0, 0]; this.height = 4.5 * size;
  }

  /** Take a named view: direction to the camera, point that it looks at, height of the picture. */
  take([dx, dy, dz, fx, fy, fz, height]) {
    const local = this.axes.map((axis) => dot(axis, [dx, dy, dz]));
    this.yaw = Math.atan2(local[0], local[2]);
    this.pitch = Math.asin(max(-1, min(1, local[1])));
    this.focus = [fx, fy, fz];
    this.height = height;
  }

  get towards() {
    const [x, y, z] = [sin(this.yaw) * cos(this.pitch), sin(this.pitch), cos(this.yaw) * cos(this.pitch)];
    return [0, 1, 2].map((k) => x * this.axes[0][k] + y * this.axes[1][k] + z * this.axes[2][k]);
  }

  basis() {
    const towards = this.towards, right = unit(cross(this.axes[1], towards));
    return { towards, right, up: cross(towards, right) };
  }

  get distance() { return this.height / (2 * tan(this.angle / 2)); }
  get position() { return add(this.focus, this.towards, this.distance); }

  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = max(-1.5, min(1.5, this.pitch + dy));
  }

  /** Move sideways and upwards by shares of the picture's height. */
  pan(dx, dy) {
    const { right, up } = this.basis();
    this.focus = add(add(this.focus, right, -dx * this.height), up, dy * this.height);
  }

  zoom(factor) { this.height = max(0.15 * this.size, min(12 * this.size, this.height * factor)); }

  /** Matrices, column by column: of the view, and of the projection. */
  matrices(aspect) {
    const { towards, right, up } = this.basis(), place = this.position;
    const view = [right[0], up[0], towards[0], 0, right[1], up[1], towards[1], 0, right[2], up[2], towards[2], 0,
      -dot(right, place), -dot(up, place), -dot(towards, place), 1];
    const focal = 1 / tan(this.angle / 2) * min(1, aspect), d = this.distance;
    const near = max(0.05 * d, d - this.extent), far = d + this.extent;
    const projection = [focal / aspect, 0, 0, 0, 0, focal, 0, 0, 0, 0, (far + near) / (near - far), -1,
      0, 0, (2 * far * near) / (near - far), 0];
    return { view, projection, focal };
  }

  /** Start and direction of the ray through a place of the picture, from -1 to 1. */
  ray(x, y, aspect) {
    const { towards, right, up } = this.basis(), focal = 1 / tan(this.angle / 2) * min(1, aspect);
    const direction = unit(add(add(add([0, 0, 0], right, (x * aspect) / focal), up, y / focal), towards, -1));
    return { start: this.position, direction };
  }
}
