// The machine in space: its table and envelope, limit switches, tool, and the way it has gone.
import {
  BoxGeometry, BufferGeometry, ConeGeometry, EdgesGeometry, Float32BufferAttribute, Group, Line, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, OrthographicCamera, Scene, SphereGeometry, Vector3,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { MachineAxis } from "./api";
import { mark } from "./dom";
import { PathLines } from "./lines";
import type { Machine } from "./machine";
import { KINDS, type Place } from "./path";
import { Screen } from "./screen";

export type Way = "isometric" | "top" | "front" | "side";

/** From where each view looks. Nearly from above still has a side that is up. */
const EYES: Record<Way, Vector3> = {
  isometric: new Vector3(-1, -1.25, 0.95),
  top: new Vector3(0, -1e-4, 1),
  front: new Vector3(0, -1, 0),
  side: new Vector3(1, 0, 0),
};
/** An axis of which nobody says how far a step goes. */
const UNKNOWN_STEP = 0.0125;
/** The size of what has no envelope, in mm, until more is needed. */
const OPEN = 60;
/** The tool takes this long to be where it was heard of, in ms. */
const GLIDE = 50;
export class MachineScene {
  private scene = new Scene();
  private camera = new OrthographicCamera(-1, 1, 1, -1, -1e5, 1e5);
  private screen: Screen;
  private controls: OrbitControls;
  private path = new PathLines(this.scene);
  private frame = new Group();
  private switches = new Map<string, Mesh<SphereGeometry, MeshBasicMaterial>>();
  private tool: Mesh<ConeGeometry, MeshBasicMaterial>;
  private plumb = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
  private trail = new Line(new BufferGeometry(), new LineBasicMaterial());
  private low = new Vector3();
  private high = new Vector3(OPEN, OPEN, OPEN / 2);
  /** The size of what has no envelope. */
  private open = OPEN;
  private machine: Machine | null = null;
  private shown = new Vector3();
  private goal = new Vector3();
  private glidesUntil = 0;
  private way: Way = "isometric";
  private colours = "";

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly labels: HTMLElement,
  ) {
    const { scene, camera } = this;
    this.screen = new Screen(canvas, { scene, camera, prepare: (...how) => this.prepare(...how) });
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.screen.draw());
    this.controls.addEventListener("start", () => this.screen.hold(true));
    this.controls.addEventListener("end", () => this.screen.hold(false));
    const cone = new ConeGeometry(0.5, 1.6, 24);
    cone.rotateX(-Math.PI / 2);
    cone.translate(0, 0, 0.8);
    this.tool = new Mesh(cone, new MeshBasicMaterial());
    this.trail.frustumCulled = this.plumb.frustumCulled = false;
    this.scene.add(this.frame, this.tool, this.plumb, this.trail);
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  /** Shows a machine as it is now. */
  show(machine: Machine): void {
    if (machine !== this.machine) {
      this.machine = machine;
      this.open = OPEN;
      this.build(machine);
      this.shown.copy(this.at(machine));
      this.look(this.way);
    }
    const goal = this.at(machine);
    if (this.outgrows(machine, goal)) {
      this.build(machine);
      this.look(this.way);
    }
    this.recolour();
    const scale = this.scale(machine);
    this.path.follow(machine.path, scale);
    if (!goal.equals(this.goal)) {
      this.goal.copy(goal);
      this.glidesUntil = performance.now() + GLIDE;
    }
    for (const [name, lamp] of this.switches) {
      lamp.material.color.set(this.css(machine.switches.has(name) ? "--alarm" : "--faint"));
      lamp.scale.setScalar(machine.switches.has(name) ? 1.7 : 1);
    }
    const points = machine.trail.map((place) => this.inMillimetres(place, scale));
    if (points.length > 0) points.push(goal);
    this.trail.geometry.dispose();
    this.trail.geometry = new BufferGeometry().setFromPoints(points);
    this.screen.draw();
  }

  /** Gives back what the graphics have lent. */
  leave(): void {
    this.controls.dispose();
    this.screen.leave();
  }

  /** Looks from there, at everything. */
  look(way: Way): void {
    this.way = way;
    const middle = this.low.clone().add(this.high).multiplyScalar(0.5);
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(EYES[way], this.size());
    this.camera.lookAt(middle);
    this.camera.zoom = 1;
    this.resize();
  }

  /** Everything there is, the path included. */
  fit(): void {
    const { machine } = this;
    if (!machine) return;
    const scale = this.scale(machine);
    this.bounds(machine);
    for (const { points } of machine.path.runs) {
      for (let i = 0; i < points.length; i += 3) {
        const place = this.inMillimetres([points[i]!, points[i + 1]!, points[i + 2]!], scale);
        this.low.min(place);
        this.high.max(place);
      }
    }
    this.low.min(this.goal);
    this.high.max(this.goal);
    this.look(this.way);
  }

  // --- where things are ---

  private scale(machine: Machine): number[] {
    return machine.spatial.map((index) => {
      const step = machine.perStep(index);
      return step?.unit === "mm" ? step.factor : UNKNOWN_STEP;
    });
  }

  private inMillimetres(place: Place, scale: readonly number[]): Vector3 {
    return new Vector3(place[0] * scale[0]!, place[1] * scale[1]!, place[2] * scale[2]!);
  }

  private at(machine: Machine): Vector3 {
    const told = machine.position?.carriage ?? machine.view?.axes.map((axis) => axis.carriage) ?? [];
    const steps = machine.byIndex(told);
    const place = machine.spatial.map((index) => steps[index] ?? 0) as unknown as Place;
    return this.inMillimetres(place, this.scale(machine));
  }

  private size(): number {
    return Math.max(this.high.distanceTo(this.low), 1);
  }

  private profile(machine: Machine, index: number): MachineAxis | null | undefined {
    const name = machine.about.axes.find((axis) => axis.index === index)?.name.toLowerCase() ?? "";
    return machine.profile.axes[name];
  }

  /** Whether a place is beyond what is drawn of axes without ends, of which then more is drawn. */
  private outgrows(machine: Machine, place: Vector3): boolean {
    const before = this.open;
    for (const [k, index] of machine.spatial.entries()) {
      if (index < 0 || this.ends(machine, index)) continue;
      while (Math.abs(place.getComponent(k)) > this.open / (k === 2 ? 4 : 2)) this.open *= 2;
    }
    return this.open !== before;
  }

  /** From where to where an axis can go, in steps; `null` if nothing limits it. */
  private ends(machine: Machine, index: number): { low: number; high: number } | null {
    const axis = this.profile(machine, index);
    const [low, high] = [axis?.negative_switch ?? axis?.lowest, axis?.positive_switch ?? axis?.highest];
    return low == null || high == null ? null : { low, high };
  }

  private bounds(machine: Machine): void {
    const scale = this.scale(machine);
    const half = this.open / 2;
    const ends = machine.spatial.map((index, k) => {
      const ends = this.ends(machine, index);
      if (ends) return { low: ends.low * scale[k]!, high: ends.high * scale[k]! };
      return index < 0 ? { low: 0, high: 0 } : { low: k === 2 ? -half / 2 : -half, high: k === 2 ? half / 2 : half };
    });
    this.low.fromArray(ends.map((end) => end.low));
    this.high.fromArray(ends.map((end) => end.high));
  }

  // --- what is drawn ---

  private build(machine: Machine): void {
    this.frame.clear();
    this.switches.clear();
    this.bounds(machine);
    const { low, high } = this;
    const extent = high.clone().sub(low);
    const box = new EdgesGeometry(new BoxGeometry(extent.x, extent.y, Math.max(extent.z, 1e-3)));
    box.translate((low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2);
    const edges = new LineSegments(box, new LineBasicMaterial());
    edges.name = "--edge";
    this.frame.add(edges, this.grid());
    const bead = new SphereGeometry(this.size() / 110, 16, 12);
    for (const [k, index] of machine.spatial.entries()) {
      const axis = this.profile(machine, index);
      for (const [sign, at] of [["-", axis?.negative_switch], ["+", axis?.positive_switch]] as const) {
        if (at == null) continue;
        const lamp = new Mesh(bead, new MeshBasicMaterial());
        lamp.position.set(k === 0 ? 0 : low.x, k === 1 ? 0 : low.y, k === 2 ? 0 : low.z);
        lamp.position.setComponent(k, sign === "-" ? low.getComponent(k) : high.getComponent(k));
        if (k === 0) lamp.position.y = low.y + extent.y / 2;
        if (k === 1) lamp.position.x = low.x + extent.x / 2;
        this.switches.set(`${index}${sign}`, lamp);
        this.frame.add(lamp);
      }
    }
    this.tool.scale.setScalar(this.size() / 26);
    this.colours = "";
  }

  /** The table, in squares of a round number of millimetres. */
  private grid(): LineSegments {
    const { low, high } = this;
    const longest = Math.max(high.x - low.x, high.y - low.y);
    const power = 10 ** Math.floor(Math.log10(longest / 4));
    const pitch = [1, 2, 5, 10].map((n) => n * power).find((size) => longest / size <= 16) ?? 10 * power;
    const ends: number[] = [];
    for (let x = Math.ceil(low.x / pitch) * pitch; x <= high.x; x += pitch) {
      ends.push(x, low.y, low.z, x, high.y, low.z);
    }
    for (let y = Math.ceil(low.y / pitch) * pitch; y <= high.y; y += pitch) {
      ends.push(low.x, y, low.z, high.x, y, low.z);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(ends, 3));
    const grid = new LineSegments(geometry, new LineBasicMaterial());
    grid.name = "--grid";
    return grid;
  }

  private css(name: string): string {
    return getComputedStyle(this.canvas).getPropertyValue(name).trim();
  }

  /** Takes the colours of the page, which may have become dark. */
  private recolour(): void {
    const key = ["--edge", "--path-feed"].map((name) => this.css(name)).join();
    if (key === this.colours) return;
    this.colours = key;
    this.screen.ground(this.css("--ground"));
    for (const kind of KINDS) this.path.colour(kind, this.css(`--path-${kind}`));
    this.tool.material.color.set(this.css("--tool"));
    this.trail.material.color.set(this.css("--tool"));
    this.plumb.material.color.set(this.css("--faint"));
    for (const part of this.frame.children) {
      if (part instanceof LineSegments) (part.material as LineBasicMaterial).color.set(this.css(part.name));
    }
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    // What is to be seen, as the camera sees it.
    this.camera.updateMatrixWorld();
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
      new Vector3(
        i & 1 ? this.high.x : this.low.x, i & 2 ? this.high.y : this.low.y, i & 4 ? this.high.z : this.low.z,
      ).applyMatrix4(this.camera.matrixWorldInverse),
    );
    const reach = (k: number) => Math.max(...corners.map((corner) => Math.abs(corner.getComponent(k))), 1e-3);
    const half = Math.max(reach(1), (reach(0) * height) / width) * 1.12;
    [this.camera.top, this.camera.bottom] = [half, -half];
    [this.camera.right, this.camera.left] = [(half * width) / height, (-half * width) / height];
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.screen.draw();
  }

  private prepare(now: number, every: number, isCoarse: boolean): void {
    this.path.coarsen(every);
    mark(this.labels.parentElement!, "data-coarse", String(isCoarse));
    const left = this.glidesUntil - now;
    if (left <= 0) this.shown.copy(this.goal);
    else this.shown.lerp(this.goal, Math.min(1, 16 / (left + 16)));
    this.tool.position.copy(this.shown);
    const { x, y, z } = this.shown;
    const { low } = this;
    this.plumb.geometry.dispose();
    this.plumb.geometry = new BufferGeometry().setFromPoints([
      new Vector3(x, y, z), new Vector3(x, y, low.z),
      new Vector3(x, low.y, low.z), new Vector3(x, y, low.z),
      new Vector3(low.x, y, low.z), new Vector3(x, y, low.z),
    ]);
    this.name();
    if (left > 0) this.screen.draw();
  }

  /** The names of the axes, at their ends; and where all that is on the page, for whoever looks there. */
  private name(): void {
    const { low, high } = this;
    const ends = [
      ["X", new Vector3(high.x, low.y, low.z)],
      ["Y", new Vector3(low.x, high.y, low.z)],
      ["Z", new Vector3(low.x, low.y, high.z)],
    ] as const;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const stage = this.labels.parentElement!;
    for (const [k, [name, end]] of ends.entries()) {
      const at = end.clone().project(this.camera);
      const [right, down] = [((at.x + 1) / 2) * width, ((1 - at.y) / 2) * height];
      const label = this.labels.children[k] as HTMLElement;
      label.style.transform = `translate(${right}px, ${down}px)`;
      stage.dataset[name.toLowerCase()] = `${right} ${down}`;
    }
    const at = this.shown.clone().project(this.camera);
    stage.dataset.tool = `${((at.x + 1) / 2) * width} ${((1 - at.y) / 2) * height}`;
  }
}
