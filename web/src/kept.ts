// What a browser remembers for a person: language, colours, units. Where it may keep nothing, the
// panel works all the same.

/** What is kept under a name. */
export function recall(name: string): string | null {
  try {
    return localStorage.getItem(`vimc4.${name}`);
  } catch {
    return null;
  }
}

/** Keeps it. */
export function keep(name: string, value: string): void {
  try {
    localStorage.setItem(`vimc4.${name}`, value);
  } catch {
    // It is asked for again next time.
  }
}
