// Draws a picture: shadow of the sun, ground, shapes, then what lies above them (arrows, lines, points).
import { CASTER, LINE, SHAPE } from "terraglue/shaders.js";
import { SHAPE_SIZE } from "terraglue/batch.js";
import { attribute, program, texture } from "terraglue/gl.js";
import { lookAt, matrixProduct, parallel, times, add, unit } from "terraglue/math.js";
import { meshCorners, solids } from "terraglue/solids.js";

const SHADOW_SIDE = 1024;
const SUN = unit([-0.62, -0.7, 0.88]);

function drawnByProcessor() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = about ? gl.getParameter(about.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** The renderer of one canvas; throws where there is no WebGL 2. */
export class Renderer {
  constructor(canvas) {
    /** Whether the processor draws: then less is drawn while things move, and edges are smooth where nothing does. */
    this.slow = drawnByProcessor();
    const gl = canvas.getContext("webgl2", { antialias: !this.slow, alpha: true, premultipliedAlpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("no WebGL 2");
    this.gl = gl;
    this.shape = program(gl, SHAPE);
    this.caster = program(gl, CASTER);
    this.line = program(gl, LINE);
    this.instances = gl.createBuffer();
    this.corners = gl.createBuffer();
    this.solids = {};
    for (const [name, corners] of Object.entries(solids(this.slow))) this.solids[name] = this.solid(new Float32Array(corners));
    this.meshes = new Map();
    this.lineArray = gl.createVertexArray();
    gl.bindVertexArray(this.lineArray);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
    attribute(gl, 0, 3, 28, 0, 0);
    attribute(gl, 1, 4, 28, 12, 0);
    this.makeShadow();
    this.dusk = 0;
  }

  solid(corners) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    attribute(gl, 0, 3, 24, 0, 0);
    attribute(gl, 1, 3, 24, 12, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    const stride = 4 * SHAPE_SIZE;
    for (let k = 0; k < 5; k++) attribute(gl, 2 + k, 4, stride, 16 * k, 1);
    attribute(gl, 7, 2, stride, 80, 1);
    return { array, count: corners.length / 6 };
  }

  /** The corners of a mesh; made once for each list of triangles. */
  mesh(triangles) {
    if (!this.meshes.has(triangles)) this.meshes.set(triangles, this.solid(meshCorners(triangles.points, triangles.indices)));
    return this.meshes.get(triangles);
  }

  makeShadow() {
    const { gl } = this;
    this.shadow = texture(gl, gl.DEPTH_COMPONENT24, SHADOW_SIDE, SHADOW_SIDE, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    this.shadowFrame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowFrame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadow, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  // Sun over a place: all within `reach` metres of it throws a shadow.
  lightMatrix(focus, reach) {
    const eye = add(focus, times(SUN, 2 * reach));
    return matrixProduct(parallel(reach, 4 * reach), lookAt(eye, focus, [0, 1, 0]));
  }

  /** Draws `drawing` on `ground` (or none) as `view` sees it; shadows within `reach` metres of `focus`. */
  draw(drawing, ground, view, focus, reach) {
    const { gl } = this;
    const light = this.lightMatrix(focus, reach);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.drawShadow(drawing, light);
    gl.viewport(0, 0, gl.canvas.width, gl.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const lit = (use) => this.bindLight(use, light, view);
    ground?.draw(view, lit);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.useProgram(this.shape.id);
    lit(this.shape);
    gl.uniformMatrix4fv(this.shape.at("viewProjection"), false, view.matrix);
    gl.uniform1f(this.shape.at("plain"), 0);
    this.drawShapes(drawing.shapes, drawing.meshes);
    this.drawShapes(drawing.ghosts, drawing.ghostMeshes);
    gl.uniform1f(this.shape.at("plain"), 1);
    this.drawShapes(drawing.marks, []);
    this.drawLines(drawing, view);
    gl.bindVertexArray(null);
  }

  drawShadow(drawing, light) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowFrame);
    gl.viewport(0, 0, SHADOW_SIDE, SHADOW_SIDE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.caster.id);
    gl.uniformMatrix4fv(this.caster.at("viewProjection"), false, light);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    this.drawShapes(drawing.shapes, drawing.meshes);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  bindLight(use, light, view) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.shadow);
    gl.uniform1i(use.at("shadowMap"), 0);
    gl.uniformMatrix4fv(use.at("lightMatrix"), false, light);
    gl.uniform3f(use.at("sun"), ...SUN);
    gl.uniform3f(use.at("eye"), ...view.eye);
    gl.uniform1f(use.at("dusk"), this.dusk);
    gl.uniform1i(use.at("taps"), view.effort === "moving" ? 1 : 4);
  }

  drawShapes(shapes, meshes) {
    for (const [name, batch] of Object.entries(shapes)) this.drawSolid(this.solids[name], batch.used);
    for (const { triangles, numbers } of meshes) this.drawSolid(this.mesh(triangles), numbers);
  }

  drawSolid(solid, numbers) {
    if (!numbers.length) return;
    const { gl } = this;
    gl.bindVertexArray(solid.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.DYNAMIC_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, solid.count, numbers.length / SHAPE_SIZE);
  }

  drawLines(drawing, view) {
    const { gl } = this;
    gl.useProgram(this.line.id);
    gl.uniformMatrix4fv(this.line.at("viewProjection"), false, view.matrix);
    gl.bindVertexArray(this.lineArray);
    for (const [batch, mode] of [[drawing.lines, gl.LINES], [drawing.points, gl.POINTS]]) {
      if (!batch.length) continue;
      gl.bindBuffer(gl.ARRAY_BUFFER, this.corners);
      gl.bufferData(gl.ARRAY_BUFFER, batch.used, gl.DYNAMIC_DRAW);
      gl.drawArrays(mode, 0, batch.length / 7);
    }
  }
}
