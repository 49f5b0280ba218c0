// Frames on a canvas: drawn only when something has changed, one after the other, and as finely as the
// computer can in time. Whatever was left out while something moved is there once it rests.
import {
  ColorManagement, LinearSRGBColorSpace, Mesh, MeshBasicMaterial, OrthographicCamera, PlaneGeometry, Scene, WebGLRenderer,
  WebGLRenderTarget, type Camera,
} from "three";
import { Pace } from "./pace";

/** Nothing moves any more after this time, in ms. */
const REST = 250;
/** A frame that is not there after this time is not waited for: the page may have been out of sight. */
const FORGOTTEN = 5_000;
/** So many samples make a pixel of what is drawn finely. */
const SAMPLES = 4;

// Colours are those of the page, and nothing is lit.
ColorManagement.enabled = false;

/** What is drawn. */
export interface Picture {
  scene: Scene;
  camera: Camera;
  /** A frame is about to be drawn, with one of so many of the older lines, coarsely or with everything. */
  prepare(now: number, every: number, isCoarse: boolean): void;
}

/** The frame that the graphics are at. */
interface Busy {
  until: WebGLSync | null;
  since: number;
  isAll: boolean;
}

export class Screen {
  private renderer: WebGLRenderer;
  private gl: WebGL2RenderingContext;
  /** Here a fine frame is drawn first. A canvas with samples of its own would have them for coarse ones, too. */
  private fine = new WebGLRenderTarget(1, 1, { samples: SAMPLES });
  private sheet = new Scene().add(
    new Mesh(new PlaneGeometry(2, 2), new MeshBasicMaterial({ map: this.fine.texture, depthTest: false })),
  );
  private above = new OrthographicCamera(-1, 1, 1, -1, -1, 1);
  private pace = new Pace();
  private wanted: "some" | "all" | null = null;
  private asked: number | null = null;
  private busy: Busy | null = null;
  private isHeld = false;
  private rest: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly picture: Picture,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: false, alpha: false });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.gl = this.renderer.getContext() as WebGL2RenderingContext;
  }

  /** What is behind everything. */
  ground(colour: string): void {
    this.renderer.setClearColor(colour);
  }

  /** Draws soon. */
  draw(): void {
    this.want("some");
  }

  /** While a hand moves it, nothing rests. */
  hold(isHeld: boolean): void {
    this.isHeld = isHeld;
    this.draw();
  }

  /** Gives back what the graphics have lent. */
  leave(): void {
    clearTimeout(this.rest);
    if (this.asked !== null) cancelAnimationFrame(this.asked);
    this.fine.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private want(wanted: "some" | "all"): void {
    this.wanted = wanted;
    this.asked ??= requestAnimationFrame((now) => this.tick(now));
  }

  /** A frame begins when the one before it is over. So it is known how long that took, and none waits in a queue. */
  private tick(now: number): void {
    this.asked = null;
    if (this.busy) this.listen(this.busy, now);
    if (!this.busy && this.wanted) this.begin(this.wanted === "all", now);
    if (this.busy) this.asked = requestAnimationFrame((next) => this.tick(next));
  }

  private listen({ until, since, isAll }: Busy, now: number): void {
    const { gl, pace } = this;
    const isLate = now - since > FORGOTTEN;
    const isOver = !until || gl.getSyncParameter(until, gl.SYNC_STATUS) !== gl.UNSIGNALED;
    if (!isOver && !isLate) return;
    gl.deleteSync(until);
    this.busy = null;
    if (isLate) return;
    if (isAll) pace.tookAll(now - since);
    else pace.took(now - since);
  }

  private begin(isAll: boolean, now: number): void {
    const { gl, pace, renderer, picture } = this;
    this.wanted = null;
    const isCoarse = !isAll && pace.level > 0;
    picture.prepare(now, isCoarse ? pace.every : 1, isCoarse);
    const ratio = Math.min(devicePixelRatio, 2) * (isCoarse ? pace.sharpness : 1);
    const { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [Math.floor(clientWidth * ratio), Math.floor(clientHeight * ratio)];
    if (width !== this.canvas.width || height !== this.canvas.height) {
      renderer.setPixelRatio(ratio);
      renderer.setSize(clientWidth, clientHeight, false);
    }
    if (isCoarse) {
      renderer.render(picture.scene, picture.camera);
    } else {
      this.fine.setSize(width, height);
      renderer.setRenderTarget(this.fine);
      renderer.render(picture.scene, picture.camera);
      renderer.setRenderTarget(null);
      renderer.render(this.sheet, this.above);
    }
    this.busy = { until: gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), since: now, isAll };
    gl.flush();
    clearTimeout(this.rest);
    if (isCoarse && !this.isHeld) this.rest = setTimeout(() => this.want("all"), REST);
  }
}
