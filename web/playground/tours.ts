// The guided tours. What a step asks for is looked at where it happens: in what the controller says of
// itself, not in what was clicked. There is no other way through a tour than to do it.
import type { Entry } from "../src/api";
import type { Machine } from "../src/machine";
import type { Pair } from "./words";

/** What has happened since a step began. */
export interface Seen {
  entries: Entry[];
  machine: Machine;
  /** Whether the past is looked at. */
  isPast: boolean;
}

export interface Step {
  title: Pair;
  text: Pair;
  /** What can be sent; a line for each command. */
  type?: string;
  met(seen: Seen): boolean;
}

export interface Tour {
  title: Pair;
  model: string;
  machine: string;
  steps: Step[];
}

/** The commands of this kind, each with what was answered to it. */
function talk({ entries }: Seen, mnemonic: string): { sent: Entry; answer: Entry | undefined }[] {
  return entries.filter((entry) => entry.kind === "command" && entry.mnemonic === mnemonic)
    .map((sent) => ({ sent, answer: entries.find(({ kind, command }) => kind === "answer" && command === sent.command) }));
}

/** A command of this kind was carried out. */
function did(seen: Seen, mnemonic: string, where: (sent: Entry, answer: Entry) => boolean = () => true): boolean {
  return talk(seen, mnemonic).some(({ sent, answer }) => answer !== undefined && answer.why === undefined && where(sent, answer));
}

/** The steps that the counter of an axis shows. */
function at(machine: Machine, axis: string): number {
  return machine.view?.axes.find(({ name }) => name === axis)?.position ?? Number.NaN;
}

/** The numbers of a command. */
function numbers(entry: Entry): number[] {
  return (entry.bytes ?? "").slice(3).split(",").map(Number);
}

/** What a circle is asked to be, by the names that its numbers have; what is not asked for may be anything. */
type Asked = Partial<Record<"B" | "V" | "D" | "x" | "y" | "Rx" | "Ry", number>>;

/** A circle was drawn with these numbers, and so that its way, from where it begins, is as asked. */
function drew(seen: Seen, { B, V, D, x, y, Rx, Ry }: Asked, isRight: (way: [number, number][]) => boolean): boolean {
  const asked = [B, V, D, x, y, Rx, Ry];
  return did(seen, "@y", (sent) => {
    const given = numbers(sent);
    if (asked.some((number, i) => number !== undefined && given[i] !== number)) return false;
    const motions = seen.entries.filter(({ kind, motion, command }) => kind === "motion" && motion === "ends" && command === sent.command);
    return motions.some(({ points }) => points !== undefined && points.length > 2 && isRight(points.map(([x = 0, y = 0]) => [x, y])));
  });
}

/** How far apart the two most distant places of a way are in X and in Y, in steps. */
function spans(way: [number, number][]): [number, number] {
  const span = (of: number[]) => Math.max(...of) - Math.min(...of);
  return [span(way.map(([x]) => x)), span(way.map(([, y]) => y))];
}

const isClosed = (way: [number, number][]) => Math.hypot(way[0]![0] - way.at(-1)![0], way[0]![1] - way.at(-1)![1]) <= 1;
const near = (found: number, wanted: number) => Math.abs(found - wanted) <= 2;

const COMMANDS: Tour = {
  title: ["The command set in ten steps", "Der Befehlssatz in zehn Schritten"],
  model: "imc4",
  machine: "mill",
  steps: [
    {
      title: ["Say which axes there are", "Sagen, welche Achsen es gibt"],
      text: [
        "A command begins with @ and the number of the device, and ends with a carriage return, which the field below adds. @07 sets X, Y and Z: 1, 2 and 4 for the axes, added up. Everything that moves needs it first. The controller answers 0: done.",
        "Ein Befehl beginnt mit @ und der Gerätenummer und endet mit einem Wagenrücklauf, den das Feld unten anfügt. @07 setzt X, Y und Z: 1, 2 und 4 für die Achsen, zusammengezählt. Alles, was sich bewegt, braucht das zuerst. Die Steuerung antwortet 0: erledigt.",
      ],
      type: "@07",
      met: (seen) => did(seen, "@axes", (sent) => sent.bytes === "@07"),
    },
    {
      title: ["Find the zero", "Den Nullpunkt finden"],
      text: [
        "After power-on nobody knows where the carriages stand. @0R7 drives each axis to its switch and out of it again: Z first, so that no tool is in the way. That place is 0. Watch the dots beside the axes.",
        "Nach dem Einschalten weiß niemand, wo die Schlitten stehen. @0R7 fährt jede Achse auf ihren Schalter und wieder heraus: Z zuerst, damit kein Werkzeug im Weg ist. Dieser Ort ist 0. Achte auf die Punkte neben den Achsen.",
      ],
      type: "@0R7",
      met: (seen) => did(seen, "@R") && (seen.machine.view?.axes ?? []).filter(({ referenced }) => referenced).length >= 3,
    },
    {
      title: ["Move", "Fahren"],
      text: [
        "@0A moves relative to where it is: for each axis steps and speed in steps a second, for Z two such pairs. The answer comes when the motion is over. Move X by 4,000 steps, which are 50 mm here, at 2,000 Hz.",
        "@0A fährt relativ zum jetzigen Ort: für jede Achse Schritte und Geschwindigkeit in Schritten je Sekunde, für Z zwei solche Paare. Die Antwort kommt, wenn die Bewegung vorbei ist. Fahre X um 4.000 Schritte, das sind hier 50 mm, mit 2.000 Hz.",
      ],
      type: "@0A4000,2000,0,900,0,900,0,900",
      met: (seen) => did(seen, "@A", (sent) => numbers(sent)[0] === 4_000 && numbers(sent)[1] === 2_000),
    },
    {
      title: ["Ask where it is", "Fragen, wo sie ist"],
      text: [
        "@0P answers 0 and then, without any end of line, six hexadecimal digits for each axis. 000FA0 is 4,000. A host has to know how many come.",
        "@0P antwortet 0 und danach ohne Zeilenende sechs hexadezimale Ziffern je Achse. 000FA0 ist 4.000. Der Rechner muss wissen, wie viele kommen.",
      ],
      type: "@0P",
      met: (seen) => did(seen, "@P"),
    },
    {
      title: ["Be refused", "Abgewiesen werden"],
      text: [
        "What cannot be done is answered with a character that says why. Send a move with too few numbers, or at a speed that the controller does not have, and open the red entry in the conversation.",
        "Was nicht geht, wird mit einem Zeichen beantwortet, das sagt warum. Sende eine Fahrt mit zu wenigen Zahlen oder mit einer Geschwindigkeit, die die Steuerung nicht hat, und öffne den roten Eintrag im Gespräch.",
      ],
      type: "@0A500",
      // 7 says that the numbers are not as many as there are for these axes, D that there is no such speed.
      met: (seen) => ["@A", "@M"].flatMap((move) => talk(seen, move)).some(({ sent, answer }) =>
        answer?.bytes === "D" || (answer?.bytes === "7" && numbers(sent).length < 8)),
    },
    {
      title: ["Stop a move", "Eine Fahrt anhalten"],
      text: [
        "Start a long move back, and press STOP on the front panel while it runs. The axes brake along their ramp, so no step is lost, and the answer is F.",
        "Starte eine lange Fahrt zurück und drücke STOP am Bedienfeld, während sie läuft. Die Achsen bremsen entlang ihrer Rampe, kein Schritt geht verloren, und die Antwort ist F.",
      ],
      type: "@0A-4000,400,0,900,0,900,0,900",
      met: ({ entries }) => entries.some(({ kind, bytes, why }) => kind === "answer" && bytes === "F" && why !== undefined),
    },
    {
      title: ["Go on", "Weiterfahren"],
      text: [
        "The controller has kept the rest of the way. Press START if the panel still holds it, and send @0S: it finishes the move, and X is 0 again.",
        "Die Steuerung hat sich den Rest des Weges gemerkt. Drücke START, falls das Bedienfeld noch hält, und sende @0S: Sie beendet die Fahrt, und X ist wieder 0.",
      ],
      type: "@0S",
      met: (seen) => did(seen, "@S") && at(seen.machine, "X") === 0,
    },
    {
      title: ["Absolute moves and ports", "Absolute Fahrten und Ports"],
      text: [
        "@0M moves to a place, counted from zero. @0B1,1 sets bits of an output port. Do both: X and Y to 2,000, and an output.",
        "@0M fährt an einen Ort, vom Nullpunkt gezählt. @0B1,1 setzt Bits eines Ausgangsports. Mach beides: X und Y auf 2.000, und einen Ausgang.",
      ],
      type: "@0M2000,2000,2000,2000,0,900,0,900\n@0B1,1",
      met: (seen) => did(seen, "@M") && did(seen, "@B") && at(seen.machine, "X") === 2_000 && at(seen.machine, "Y") === 2_000,
    },
    {
      title: ["Store a program", "Ein Programm speichern"],
      text: [
        "Between @0i and 9 lines are stored instead of carried out: 0 is a relative move. START on the panel runs them, without any host. Store a line that moves X there, one that moves it back, and press START.",
        "Zwischen @0i und 9 werden Zeilen gespeichert statt ausgeführt: 0 ist eine relative Fahrt. START am Bedienfeld führt sie aus, ganz ohne Rechner. Speichere eine Zeile, die X hinfährt, eine, die es zurückfährt, und drücke START.",
      ],
      type: "@0i\n0800,2000,0,900,0,900,0,900\n0-800,2000,0,900,0,900,0,900\n9",
      met: ({ entries }) => entries.filter(({ kind }) => kind === "line").length >= 2,
    },
    {
      title: ["Go back in time", "In der Zeit zurückgehen"],
      text: [
        "Everything that happened is kept. Drag the time line back, or press its button for the previous entry: the machine stands as it stood then, and the controller is paused. Leave the past to go on.",
        "Alles, was geschehen ist, bleibt erhalten. Ziehe die Zeitachse zurück oder drücke ihre Taste für den vorigen Eintrag: Die Maschine steht, wie sie damals stand, und die Steuerung ist angehalten. Verlasse die Vergangenheit, um weiterzumachen.",
      ],
      met: ({ isPast }) => isPast,
    },
  ],
};

/** From the right end of the circle of radius 400, either way round. */
const CIRCLE: Asked = { D: -200, x: 400, y: 0, Rx: -1 };

const CIRCLES: Tour = {
  title: ["How it makes a circle of steps", "Wie aus Schritten ein Kreis wird"],
  model: "imc4",
  machine: "bench",
  steps: [
    {
      title: ["A controller that knows no sine", "Eine Steuerung ohne Sinus"],
      text: [
        "The processor of such a controller adds and compares, no more. Still it makes circles: one step of one axis at a time, and a register that says which axis is next. Set the axes X and Y first, and look from above (Top XY).",
        "Der Prozessor einer solchen Steuerung addiert und vergleicht, mehr nicht. Kreise macht sie trotzdem: ein Schritt einer Achse nach dem anderen, und ein Register sagt, welche Achse an der Reihe ist. Setze zuerst die Achsen X und Y, und sieh von oben darauf (Oben XY).",
      ],
      type: "@03",
      met: (seen) => did(seen, "@axes", ({ bytes }) => (Number(bytes?.slice(2)) & 3) === 3),
    },
    {
      title: ["A whole circle", "Ein ganzer Kreis"],
      text: [
        "@0y has seven numbers: how many steps B, the speed V, the register D at the start, where the start is as seen from the centre (x, y), and the directions Rx and Ry. From (400, 0), which is the right end, a full circle is 8 × 400 steps, and D is −200. Draw it.",
        "@0y hat sieben Zahlen: wie viele Schritte B, die Geschwindigkeit V, das Register D am Anfang, wo der Anfang vom Mittelpunkt aus liegt (x, y), und die Richtungen Rx und Ry. Von (400, 0) aus, dem rechten Ende, ist ein ganzer Kreis 8 × 400 Schritte lang, und D ist −200. Zeichne ihn.",
      ],
      type: "@0y3200,1000,-200,400,0,-1,1",
      met: (seen) => drew(seen, { ...CIRCLE, B: 3_200 }, (way) => isClosed(way) && spans(way).every((span) => near(span, 800))),
    },
    {
      title: ["Why eight times the radius", "Warum achtmal der Radius"],
      text: [
        "A quarter goes 400 steps to the left and 400 up, one axis at a time: 800 steps, whatever the curve between them is. So a half circle has 4 × 400. Draw a half circle of the same radius: only B changes.",
        "Ein Viertel geht 400 Schritte nach links und 400 nach oben, immer eine Achse: 800 Schritte, wie auch immer die Kurve dazwischen ist. Ein Halbkreis hat also 4 × 400. Zeichne einen Halbkreis mit demselben Radius: Nur B ändert sich.",
      ],
      type: "@0y1600,1000,-200,400,0,-1,1",
      met: (seen) => drew(seen, { ...CIRCLE, B: 1_600 }, (way) => !isClosed(way) && near(spans(way)[0], 800) && near(spans(way)[1], 400)),
    },
    {
      title: ["Twice as large", "Doppelt so groß"],
      text: [
        "Now you: a full circle of radius 800. The start is (800, 0), B is eight radii, and D is minus half a radius.",
        "Jetzt du: ein ganzer Kreis mit Radius 800. Der Anfang ist (800, 0), B sind acht Radien, und D ist minus ein halber Radius.",
      ],
      type: "@0y6400,2000,-400,800,0,-1,1",
      met: (seen) => drew(seen, { ...CIRCLE, B: 6_400, D: -400, x: 800 }, (way) => isClosed(way) && spans(way).every((span) => near(span, 1_600))),
    },
    {
      title: ["The other way round", "Andersherum"],
      text: [
        "Which way it goes follows from Rx and Ry: from the right end X can only shrink, so Rx is −1; Ry is 1 upwards, −1 downwards. The command @0f for the direction is stored, and nothing else comes of it. Draw a circle of radius 400 that begins downwards.",
        "Wie herum es geht, folgt aus Rx und Ry: Vom rechten Ende aus kann X nur kleiner werden, also ist Rx −1; Ry ist 1 nach oben, −1 nach unten. Der Befehl @0f für die Richtung wird gespeichert, sonst folgt nichts daraus. Zeichne einen Kreis mit Radius 400, der nach unten beginnt.",
      ],
      type: "@0y3200,1000,-200,400,0,-1,-1",
      met: (seen) => drew(seen, { ...CIRCLE, B: 3_200, Ry: -1 }, (way) => isClosed(way) && spans(way).every((span) => near(span, 800))),
    },
    {
      title: ["What D is for", "Wozu D da ist"],
      text: [
        "The loop is: if D is above 0, a step of X, and D loses |x|; otherwise a step of Y, and D gains |y|. So D says whether the place is outside or inside of the circle. With a D that belongs to no circle the way is none. Send the circle with D = −40,000 and see how long it takes to find its way.",
        "Die Schleife lautet: Ist D über 0, ein Schritt in X, und D verliert |x|; sonst ein Schritt in Y, und D gewinnt |y|. D sagt also, ob der Ort außerhalb oder innerhalb des Kreises liegt. Mit einem D, das zu keinem Kreis gehört, ist auch der Weg keiner. Sende den Kreis mit D = −40.000 und sieh, wie lange er braucht, um sich zu fangen.",
      ],
      type: "@0y3200,1000,-40000,400,0,-1,1",
      met: (seen) => drew(seen, { ...CIRCLE, B: 3_200, D: -40_000 }, () => true),
    },
    {
      title: ["The manual's example", "Das Beispiel des Handbuchs"],
      text: [
        "A quarter from 135 to 225 degrees with radius 200 begins at (−141, 141). Off the axes D is no simple half; 119 is what the circle gives there. Where does it end? 282 steps below the start: twice 141. Draw it, and look at Y.",
        "Ein Viertel von 135 bis 225 Grad mit Radius 200 beginnt bei (−141, 141). Abseits der Achsen ist D keine einfache Hälfte; 119 ergibt der Kreis dort. Wo endet es? 282 Schritte unter dem Anfang: zweimal 141. Zeichne es, und sieh auf Y.",
      ],
      type: "@0y400,1500,119,-141,141,-1,-1",
      met: (seen) => drew(seen, { D: 119, x: -141, y: 141 }, (way) => way.at(-1)![0] === way[0]![0] && way.at(-1)![1] - way[0]![1] === -282),
    },
    {
      title: ["Stop inside a circle", "Mitten im Kreis anhalten"],
      text: [
        "Draw a slow circle, press STOP on the way, then send @0S (after START, if the panel holds). The rest is drawn with the same register, so the circle closes as if nothing had been.",
        "Zeichne einen langsamen Kreis, drücke unterwegs STOP und sende dann @0S (nach START, falls das Bedienfeld hält). Der Rest wird mit demselben Register gezeichnet, und der Kreis schließt sich, als wäre nichts gewesen.",
      ],
      type: "@0y3200,200,-200,400,0,-1,1",
      met: (seen) => talk(seen, "@y").some(({ answer }) => answer?.bytes === "F") && did(seen, "@S"),
    },
  ],
};

export const TOURS: Record<string, Tour> = { commands: COMMANDS, circles: CIRCLES };
