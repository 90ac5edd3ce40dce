// The ground on the graphics card: heights as a texture that moves the corners of a grid, slopes and sinkage as a second one that
// colours it. Tiles of 64 nodes are loaded one by one, and drawn the coarser the farther they are.
import { GROUND, GROUND_COARSE } from "terraglue/shaders.js";
import { attribute, program, texture } from "terraglue/gl.js";
import { paletteRows } from "terraglue/palette.js";

const EDGE = 64;
const STRIDES = [1, 2, 4, 8, 16];
/** Pixels between neighbouring corners of the grid, about, by how much the picture may cost; colours and slopes stay as fine. */
const APART = { card: 3, still: 5, moving: 24 };

// Corners of one tile, every `stride` nodes, with a wall downwards around it that closes gaps to coarser neighbours; and its faces.
function tileGrid(stride) {
  const n = EDGE / stride;
  const side = n + 3;
  const corners = [];
  const faces = [];
  for (let j = -1; j <= n + 1; j++) {
    for (let i = -1; i <= n + 1; i++) {
      const [a, b] = [Math.min(Math.max(i, 0), n), Math.min(Math.max(j, 0), n)];
      corners.push(a * stride, b * stride, a === i && b === j ? 0 : 1);
      const k = corners.length / 3 - 1;
      if (i <= n && j <= n) faces.push(k, k + 1, k + side + 1, k, k + side + 1, k + side);
    }
  }
  return { corners: new Float32Array(corners), faces: new Uint16Array(faces) };
}

/** A ground of `nx` × `ny` nodes, `spacing` apart, the first at `x0`, `y0`; `height` and `sinkage` in m. */
export class Relief {
  constructor(gl, lattice) {
    Object.assign(this, { gl, lattice, colours: 2, range: [0, 1], grid: true });
    const { nx, ny } = lattice;
    this.height = new Float32Array(nx * ny);
    this.sinkage = new Float32Array(nx * ny);
    this.programs = { fine: program(gl, GROUND), coarse: program(gl, GROUND_COARSE) };
    this.heights = texture(gl, gl.R32F, nx, ny, gl.NEAREST);
    this.surface = texture(gl, gl.RGBA16F, nx, ny, gl.LINEAR);
    this.palette = texture(gl, gl.RGBA8, 256, 3, gl.LINEAR);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 3, gl.RGBA, gl.UNSIGNED_BYTE, paletteRows());
    this.tiles = gl.createBuffer();
    this.levels = STRIDES.map((stride) => this.level(stride));
  }

  level(stride) {
    const { gl } = this;
    const { corners, faces } = tileGrid(stride);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    attribute(gl, 0, 3, 12, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.tiles);
    attribute(gl, 1, 2, 8, 0, 1);
    return { array, count: faces.length };
  }

  /** Loads a rectangle of nodes; slopes reach one node farther. */
  load(i0 = 0, j0 = 0, width = this.lattice.nx, height = this.lattice.ny) {
    const { gl, lattice: { nx, ny } } = this;
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, nx);
    gl.bindTexture(gl.TEXTURE_2D, this.heights);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, i0, j0, width, height, gl.RED, gl.FLOAT, this.height, j0 * nx + i0);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, 0);
    const [a, b] = [Math.max(i0 - 1, 0), Math.max(j0 - 1, 0)];
    const [c, d] = [Math.min(i0 + width + 1, nx), Math.min(j0 + height + 1, ny)];
    gl.bindTexture(gl.TEXTURE_2D, this.surface);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, a, b, c - a, d - b, gl.RGBA, gl.FLOAT, this.slopes(a, b, c, d));
    this.ends = null;
  }

  // Slopes against x and y, sinkage and height of the nodes a ≤ i < c, b ≤ j < d.
  slopes(a, b, c, d) {
    const { height, sinkage, lattice: { nx, ny, spacing } } = this;
    const out = new Float32Array(4 * (c - a) * (d - b));
    let k = 0;
    for (let j = b; j < d; j++) {
      const [south, north] = [Math.max(j - 1, 0) * nx, Math.min(j + 1, ny - 1) * nx];
      for (let i = a; i < c; i++) {
        const [west, east, node] = [Math.max(i - 1, 0), Math.min(i + 1, nx - 1), j * nx + i];
        out[k++] = -(height[j * nx + east] - height[j * nx + west]) / ((east - west || 1) * spacing);
        out[k++] = -(height[north + i] - height[south + i]) / (((north - south) / nx || 1) * spacing);
        out[k++] = sinkage[node];
        out[k++] = height[node];
      }
    }
    return out;
  }

  /** Lowest and highest value of a layer (1 height, 2 sinkage, 3 slope), rounded outwards. */
  extent(layer) {
    if (layer === 3) return [0, 0.6];
    const values = layer === 1 ? this.height : this.sinkage;
    let [low, high] = [Infinity, -Infinity];
    for (const v of values) { if (v < low) low = v; if (v > high) high = v; }
    if (layer === 1) return high > low ? [low, high] : [low - 0.01, low + 0.01];
    const most = Math.max(high, -low, 0.005);
    return [-most, most];
  }

  /** Height under a place; NaN beside the ground. */
  heightAt(x, y) {
    const { nx, ny, spacing, x0, y0 } = this.lattice;
    const [i, j] = [Math.round((x - x0) / spacing), Math.round((y - y0) / spacing)];
    return i >= 0 && j >= 0 && i < nx && j < ny ? this.height[j * nx + i] : NaN;
  }

  // Tiles in sight, for each level of detail.
  inSight(view) {
    const { nx, ny, spacing, x0, y0 } = this.lattice;
    const half = 0.5 * EDGE * spacing;
    const lists = STRIDES.map(() => []);
    for (let j = 0; j < ny - 1; j += EDGE) {
      for (let i = 0; i < nx - 1; i += EDGE) {
        const centre = [x0 + i * spacing + half, y0 + j * spacing + half, this.heightAt(x0 + i * spacing, y0 + j * spacing)];
        if (!view.sees(centre, 2.2 * half)) continue;
        const away = Math.max(view.distance(centre) - 1.5 * half, 0.05);
        const fits = (APART[view.effort] * away) / (view.focal * spacing);
        const level = STRIDES.findLastIndex((stride) => stride <= fits);
        lists[Math.max(level, 0)].push(i, j);
      }
    }
    return lists;
  }

  draw(view, light) {
    const { gl, lattice } = this;
    const use = this.programs[view.effort === "moving" ? "coarse" : "fine"];
    gl.useProgram(use.id);
    light(use);
    gl.uniformMatrix4fv(use.at("viewProjection"), false, view.matrix);
    gl.uniform2i(use.at("size"), lattice.nx, lattice.ny);
    gl.uniform2f(use.at("texels"), lattice.nx, lattice.ny);
    gl.uniform3f(use.at("lattice"), lattice.x0, lattice.y0, lattice.spacing);
    gl.uniform1f(use.at("drop"), 6 * lattice.spacing);
    gl.uniform1i(use.at("layer"), this.colours);
    gl.uniform2f(use.at("range"), ...this.range);
    gl.uniform1f(use.at("grid"), this.grid ? 1 : 0);
    [this.heights, this.surface, this.palette].forEach((of, k) => {
      gl.activeTexture(gl.TEXTURE1 + k);
      gl.bindTexture(gl.TEXTURE_2D, of);
      gl.uniform1i(use.at(["heights", "surface", "palette"][k]), 1 + k);
    });
    this.inSight(view).forEach((list, k) => {
      if (!list.length) return;
      gl.bindVertexArray(this.levels[k].array);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.tiles);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.DYNAMIC_DRAW);
      gl.drawElementsInstanced(gl.TRIANGLES, this.levels[k].count, gl.UNSIGNED_SHORT, 0, list.length / 2);
    });
    gl.activeTexture(gl.TEXTURE0);
  }
}
