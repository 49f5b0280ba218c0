// Elements in one expression. Text is always set as text: what comes from a serial line can never
// become a part of the page.

type Child = Node | string | null | undefined | false;
type Props<K extends keyof HTMLElementTagNameMap> = {
  [P in keyof HTMLElementTagNameMap[K]]?: HTMLElementTagNameMap[K][P];
} & { class?: string; attrs?: Record<string, string>; on?: Record<string, (event: Event) => void> };

/** An element with its properties and children. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props<K> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  const { class: name, attrs, on, ...rest } = props as Props<"div">;
  Object.assign(element, rest);
  if (name) element.className = name;
  for (const [key, value] of Object.entries(attrs ?? {})) element.setAttribute(key, value);
  for (const [type, listener] of Object.entries(on ?? {})) element.addEventListener(type, listener);
  element.append(...children.filter((child): child is Node | string => Boolean(child)));
  return element;
}

/** Sets a text only where it differs, so that screen readers are told of changes alone. */
export function put(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets an attribute only where it differs. */
export function mark(element: Element, name: string, value: string | null): void {
  if (value === null) element.removeAttribute(name);
  else if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

/** Replaces children only when what they are made of has changed, so that focus stays where it is. */
export class Rebuilt {
  private made: string | null = null;
  constructor(private readonly element: HTMLElement) {}

  from(key: unknown, make: () => Child[]): void {
    const text = JSON.stringify(key) ?? "";
    if (text === this.made) return;
    this.made = text;
    this.element.replaceChildren(...make().filter((child): child is Node | string => Boolean(child)));
  }
}

let ids = 0;

/** A part of the page with its heading. */
export function card(name: string, title: string, ...children: Child[]): HTMLElement {
  const id = `heading-${++ids}`;
  return h(
    "section",
    { class: `card ${name}`, attrs: { "aria-labelledby": id } },
    h("h2", { id }, title),
    ...children,
  );
}
