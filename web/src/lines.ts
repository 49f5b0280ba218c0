// The way of a machine as lines on the screen: one buffer for each kind of way, which grows.
import { BufferAttribute, BufferGeometry, DynamicDrawUsage, LineBasicMaterial, LineDashedMaterial, LineSegments, type Scene } from "three";
import { KINDS, type Kind, type Path } from "./path";

const DASHED: readonly Kind[] = ["rapid", "reference"];
const FIRST = 1_024;
/** So many of the latest lines are drawn whatever is left out of the others. */
const LATEST = 512;

/** The lines of one kind. */
class Lines {
  readonly object: LineSegments<BufferGeometry, LineBasicMaterial | LineDashedMaterial>;
  private size = FIRST;
  private count = 0;
  private ends = new Float32Array(FIRST * 6);
  private along = new Float32Array(FIRST * 2);
  private chosen: BufferAttribute | null = null;
  private every = 1;

  constructor(private readonly isDashed: boolean) {
    const material = isDashed ? new LineDashedMaterial({ dashSize: 2, gapSize: 1.4 }) : new LineBasicMaterial();
    this.object = new LineSegments(new BufferGeometry(), material);
    this.object.frustumCulled = false;
    this.attach();
  }

  clear(): void {
    this.count = 0;
    this.object.geometry.setDrawRange(0, 0);
  }

  add(from: ArrayLike<number>, i: number, scale: readonly number[]): void {
    if (this.count === this.size) this.grow();
    const at = this.count * 6;
    let square = 0;
    for (let k = 0; k < 6; k++) this.ends[at + k] = from[i + k]! * scale[k % 3]!;
    for (let k = 0; k < 3; k++) square += (this.ends[at + 3 + k]! - this.ends[at + k]!) ** 2;
    this.along[this.count * 2 + 1] = Math.sqrt(square);
    this.count += 1;
  }

  /** Hands what was added since `before` to the graphics. */
  flush(before: number): void {
    const { geometry } = this.object;
    this.choose();
    if (before === this.count) return;
    for (const [name, width] of [["position", 6], ["lineDistance", 2]] as const) {
      const attribute = geometry.getAttribute(name) as BufferAttribute | undefined;
      if (!attribute) continue;
      attribute.addUpdateRange(before * width, (this.count - before) * width);
      attribute.needsUpdate = true;
    }
  }

  /** Of the older lines, draws one of so many only. */
  coarsen(every: number): void {
    if (every === this.every) return;
    this.every = every;
    this.choose();
  }

  private choose(): void {
    const { geometry } = this.object;
    const old = this.count - LATEST;
    if (this.every === 1 || old <= 0) {
      geometry.setIndex(null);
      geometry.setDrawRange(0, this.count * 2);
      return;
    }
    this.chosen ??= new BufferAttribute(new Uint32Array(this.size * 2), 1).setUsage(DynamicDrawUsage);
    let size = 0;
    for (let i = 0; i < this.count; i += i < old ? this.every : 1) {
      this.chosen.array[size++] = 2 * i;
      this.chosen.array[size++] = 2 * i + 1;
    }
    this.chosen.addUpdateRange(0, size);
    this.chosen.needsUpdate = true;
    geometry.setIndex(this.chosen);
    geometry.setDrawRange(0, size);
  }

  get length(): number {
    return this.count;
  }

  private grow(): void {
    this.size *= 2;
    const widened = (old: Float32Array, width: number) => {
      const wide = new Float32Array(this.size * width);
      wide.set(old);
      return wide;
    };
    this.ends = widened(this.ends, 6);
    this.along = widened(this.along, 2);
    this.attach();
  }

  private attach(): void {
    this.object.geometry.dispose();
    this.object.geometry = new BufferGeometry();
    this.chosen = null;
    const put = (name: string, array: Float32Array, width: number) => {
      const attribute = new BufferAttribute(array, width);
      attribute.setUsage(DynamicDrawUsage);
      this.object.geometry.setAttribute(name, attribute);
    };
    put("position", this.ends, 3);
    if (this.isDashed) put("lineDistance", this.along, 1);
  }
}

/** All lines of a path, which follow it as it grows. */
export class PathLines {
  private lines = new Map<Kind, Lines>();
  private edition = -1;
  private run = 0;
  private corner = 0;
  private of: Path | null = null;

  constructor(scene: Scene) {
    for (const kind of KINDS) {
      const lines = new Lines(DASHED.includes(kind));
      this.lines.set(kind, lines);
      scene.add(lines.object);
    }
  }

  colour(kind: Kind, colour: string): void {
    this.lines.get(kind)?.object.material.color.set(colour);
  }

  /** Of the older lines of each kind, draws one of so many only. */
  coarsen(every: number): void {
    for (const lines of this.lines.values()) lines.coarsen(every);
  }

  /** Takes over what is new. Returns whether anything was. */
  follow(path: Path, scale: readonly number[]): boolean {
    const isAnew = path !== this.of || path.edition !== this.edition;
    if (isAnew) {
      for (const lines of this.lines.values()) lines.clear();
      [this.of, this.edition, this.run, this.corner] = [path, path.edition, 0, 0];
    }
    const before = new Map([...this.lines].map(([kind, lines]) => [kind, lines.length]));
    for (; this.run < path.runs.length; this.run++, this.corner = 0) {
      const { kind, points } = path.runs[this.run]!;
      const lines = this.lines.get(kind)!;
      for (; this.corner + 3 < points.length; this.corner += 3) lines.add(points, this.corner, scale);
      // The last run may go on.
      if (this.run === path.runs.length - 1) break;
    }
    let isNew = isAnew;
    for (const [kind, lines] of this.lines) {
      isNew ||= lines.length !== before.get(kind);
      lines.flush(before.get(kind)!);
    }
    return isNew;
  }
}
