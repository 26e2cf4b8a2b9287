// The shadow of the key light: what its lamp sees of the skin, and how much of the lamp each vertex of the skin sees, as in pictures.

import { KEY } from "./materials.js";
import { PLACES, program } from "./shaders.js";

const UNIT = 15; // of textures, which nothing else uses

/** Middle, and radius, of the ball around a box around points. */
function around(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < points.length; k++) {
    low[k % 3] = Math.min(low[k % 3], points[k]);
    high[k % 3] = Math.max(high[k % 3], points[k]);
  }
  return [low.map((v, k) => (v + high[k]) / 2), Math.hypot(...low.map((v, k) => high[k] - v)) / 2];
}

export class Shadow {
  constructor(gl) {
    this.gl = gl;
    this.casting = program(gl, "shadow");
    this.sharing = program(gl, "lit");
    this.vao = gl.createVertexArray();
    this.buffer = gl.createBuffer(); // of triangles
    gl.activeTexture(gl.TEXTURE0 + UNIT);
    const depths = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, depths);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, KEY.texels, KEY.texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.activeTexture(gl.TEXTURE0);
    this.target = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depths, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** Look at the skin of a view from the lamp, which stays beside the camera. The viewport is another one then. */
  cast(skin, { camera: { size }, matrices: { view } }) {
    const { gl } = this, { buffers, arrays: { index, lined = [] }, points } = skin, [middle, radius] = around(points);
    this.view = view;
    this.ball = [...[0, 1, 2].map((k) => view[k] * middle[0] + view[4 + k] * middle[1] + view[8 + k] * middle[2] + view[12 + k]), radius];
    this.ray = Math.max(KEY.step * size, (2 * radius) / KEY.texels);
    this.border = KEY.soft * size;
    gl.bindVertexArray(this.vao);
    [["position", PLACES.position, 3], ["normal", PLACES.small_normal, 4]].forEach(([key, place, width]) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[key].buffer);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, width, gl.FLOAT, false, 0, 0);
    });
    if (this.index !== index) { // the triangles of the frame, which software draws in half the time of the split ones
      const triangles = new Uint32Array(index.length + lined.length);
      triangles.set(index);
      triangles.set(lined, index.length);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.DYNAMIC_DRAW);
      Object.assign(this, { index, count: triangles.length });
    }
    this.use(this.casting);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, KEY.texels, KEY.texels);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE); // of what faces away, something else is before it
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.CULL_FACE);
    this.use(this.sharing);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, buffers.lit.buffer);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, points.length / 3);
    gl.endTransformFeedback();
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
  }

  use({ made, uniforms }) {
    this.gl.useProgram(made);
    this.gl.uniformMatrix4fv(uniforms.view, false, this.view);
    this.tell(uniforms);
  }

  /** Tell a program where the shadow is. */
  tell(uniforms) {
    const { gl } = this;
    gl.uniform4fv(uniforms.ball, this.ball);
    if (!uniforms.depths) return;
    gl.uniform1i(uniforms.depths, UNIT);
    gl.uniform1f(uniforms.ray, this.ray);
    gl.uniform1f(uniforms.border, this.border);
  }
}
