// How finely the machine is drawn while something moves: as finely as the computer can in time. What it
// can is learnt from the frames themselves, since nothing else tells it.

/** A frame that takes longer than this is too slow, in ms: 20 a second are the least. */
const SLOW = 45;
/** So long one should take, */
const AIM = 33;
/** and in less than that there is time to spare. */
const QUICK = 24;
/** After so many quick frames one after the other, more is drawn. */
const PATIENCE = 6;
/** A step up that was too much is tried again later, and later, but after so many quick frames. */
const LONGEST = 640;
/** Beyond this nothing is gained. */
const COARSEST = 10;

export class Pace {
  /** How coarse: 0 is everything, each step halves something. */
  level = 0;
  private quick = 0;
  private patience = PATIENCE;
  private isTrial = false;

  /** Pixels along each side, of those that the screen has: half of all pixels, then a quarter. */
  get sharpness(): number {
    return [1, Math.SQRT1_2][this.level] ?? 0.5;
  }

  /** Of so many of the older lines one is drawn. */
  get every(): number {
    return 2 ** Math.max(0, this.level - 2);
  }

  /** A frame at this level has taken so long, in ms. */
  took(time: number): void {
    this.quick = time < QUICK ? this.quick + 1 : 0;
    if (time > SLOW) {
      if (this.isTrial) this.patience = Math.min(2 * this.patience, LONGEST);
      this.isTrial = false;
      this.level = Math.min(this.level + stepsFor(time), COARSEST);
    } else if (this.quick >= this.patience && this.level > 0) {
      this.level -= 1;
      this.isTrial = true;
      this.quick = 0;
    }
  }

  /** A frame with everything has taken so long: what moves next begins with what that allows. */
  tookAll(time: number): void {
    this.level = time > SLOW ? Math.min(stepsFor(time), COARSEST) : 0;
    [this.quick, this.patience, this.isTrial] = [0, PATIENCE, false];
  }
}

/** How often the work must be halved to be in time. */
function stepsFor(time: number): number {
  return Math.ceil(Math.log2(time / AIM));
}
