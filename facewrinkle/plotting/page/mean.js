// Pictures of a face at rest: the mean of several that are shifted by parts of a pixel, so that edges have no stairs.

import { program } from "./shaders.js";

/** Shifts of the pictures, in pixels: eight queens on a board, so that no two share a row or a column. */
export const SHIFTS = [0, 4, 7, 5, 2, 6, 1, 3].map((row, column) => [(column - 3.5) / 8, (row - 3.5) / 8]);

export class Mean {
  constructor(gl) {
    this.gl = gl;
    this.adding = program(gl, "copy");
    this.empty = gl.createVertexArray();
    this.exact = gl.getExtension("EXT_color_buffer_float") !== null; // bytes would round each time
    this.sum = gl.createTexture();
    this.last = gl.createTexture();
    this.target = gl.createFramebuffer();
  }

  /** Take the picture that was drawn as one of as many as there are then, and show their mean in its place. */
  take(count) {
    const { gl } = this, { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.last);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.copyTexImage2D(gl.TEXTURE_2D, 0, gl.RGB, 0, 0, width, height, 0);
    if (count === 1) {
      gl.bindTexture(gl.TEXTURE_2D, this.sum);
      gl.texImage2D(gl.TEXTURE_2D, 0, this.exact ? gl.RGBA16F : gl.RGBA8, width, height, 0, gl.RGBA, this.exact ? gl.HALF_FLOAT : gl.UNSIGNED_BYTE, null);
      gl.bindTexture(gl.TEXTURE_2D, this.last);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.sum, 0);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendColor(0, 0, 0, 1 / count);
    gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
    gl.useProgram(this.adding.made);
    gl.uniform1i(this.adding.uniforms.picture, 0);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }
}
