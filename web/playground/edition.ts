// Which edition of the page this is, whether it is kept so that it opens without a network, and whether another one is
// there: this one goes on with its own files until all its tabs are closed.

/** Which edition a page is, that asks to be served by what keeps it. */
export interface Asked {
  edition: string;
}
/** Which edition is kept, if that is another one. */
export interface Told {
  edition: string;
}

export class Edition {
  isKept = false;
  isOld = false;
  /** As the build has written it into the page. */
  private readonly own = document.querySelector<HTMLMetaElement>('meta[name="edition"]')?.content ?? "";

  constructor(private readonly onChange: () => void) {}

  /** Has it kept. Where that is not possible the page works all the same, as long as there is a network. */
  async keep(): Promise<void> {
    if (!("serviceWorker" in navigator)) return;
    const keeper = navigator.serviceWorker;
    try {
      const registration = await keeper.register("service.js");
      const look = () => {
        const { active, waiting } = registration;
        this.isKept = keeper.controller !== null;
        // The first of all does not wait for long.
        this.isOld ||= waiting !== null && active !== null;
        if (!this.isKept) active?.postMessage({ edition: this.own } satisfies Asked);
        this.onChange();
      };
      const follow = () => registration.installing?.addEventListener("statechange", look);
      registration.addEventListener("updatefound", follow);
      keeper.addEventListener("controllerchange", look);
      keeper.addEventListener("message", ({ data }: MessageEvent<Told>) => {
        this.isOld ||= data.edition !== this.own;
        this.onChange();
      });
      keeper.startMessages();
      follow();
      look();
      await keeper.ready;
      look();
    } catch {
      // It is tried again at the next visit.
    }
  }
}
