// Lists of numbers that go to the graphics card once a picture: places of shapes, corners of lines.

/** Numbers of one shape: matrix, colour, width of its two ends. */
export const SHAPE_SIZE = 22;

/** A list of numbers that grows. */
export class Batch {
  constructor() { this.numbers = new Float32Array(1024); this.length = 0; }
  clear() { this.length = 0; }
  // Room for so many more.
  room(count) {
    if (this.length + count <= this.numbers.length) return;
    const larger = new Float32Array(Math.max(2 * this.numbers.length, this.length + count));
    larger.set(this.numbers.subarray(0, this.length));
    this.numbers = larger;
  }
  push(...parts) {
    for (const part of parts) {
      this.room(part.length);
      this.numbers.set(part, this.length);
      this.length += part.length;
    }
  }
  get used() { return this.numbers.subarray(0, this.length); }
}

/** All shapes of one picture. */
export class Drawing {
  constructor() {
    this.shapes = { box: new Batch(), sphere: new Batch(), cylinder: new Batch() };
    this.marks = { sphere: new Batch(), cylinder: new Batch() };
    // seen through, behind all else that they could hide
    this.ghosts = { box: new Batch(), sphere: new Batch(), cylinder: new Batch() };
    this.meshes = [];
    this.ghostMeshes = [];
    this.lines = new Batch();
    this.points = new Batch();
  }
  clear() {
    for (const batch of [...[this.shapes, this.marks, this.ghosts].flatMap(Object.values), this.lines, this.points]) batch.clear();
    this.meshes = [];
    this.ghostMeshes = [];
  }
}
