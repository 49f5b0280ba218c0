// The words that the page has besides those of the panel.
import { inLanguage } from "../src/words";

export type Pair = readonly [english: string, german: string];

const TABLE = {
  desk: ["What runs here", "Was hier läuft"],
  controller: ["Controller", "Steuerung"],
  machine: ["Machine", "Maschine"],
  begin: ["Begin anew", "Neu beginnen"],
  openFile: ["Open a file …", "Datei öffnen …"],
  examples: ["Examples", "Beispiele"],
  example: ["Open an example", "Beispiel öffnen"],
  share: ["Share this moment", "Diesen Moment teilen"],
  shared: ["The link to this moment is copied, and in the address of this page.", "Der Link zu diesem Moment ist kopiert und steht in der Adresse dieser Seite."],
  sharedHere: ["The link to this moment is now the address of this page.", "Der Link zu diesem Moment ist jetzt die Adresse dieser Seite."],
  longLink: [
    "The link to this moment is the address of this page. It is long: some programs cut such links. A recording can be kept instead.",
    "Der Link zu diesem Moment ist die Adresse dieser Seite. Er ist lang: Manche Programme kürzen solche Links. Statt dessen lässt sich eine Aufzeichnung sichern.",
  ],
  badLink: ["This link is not whole, so a new session has begun.", "Dieser Link ist nicht vollständig, darum hat eine neue Sitzung begonnen."],
  atMoment: ["This is the moment of the link. The controller is paused.", "Das ist der Moment des Links. Die Steuerung ist angehalten."],
  otherwise: ["Not all of it could be done again", "Nicht alles ließ sich wiederholen"],
  save: ["Save a recording", "Aufzeichnung sichern"],
  drop: ["Drop it here: a recording, a job, a command list, a stored program, a plot", "Hier ablegen: Aufzeichnung, Auftrag, Befehlsliste, gespeichertes Programm, Plot"],
  unknownFile: ["This is no recording, job, command list, program or plot", "Das ist keine Aufzeichnung, kein Auftrag, keine Befehlsliste, kein Programm und kein Plot"],
  backToDesk: ["Back to the controller", "Zurück zur Steuerung"],
  carriesOut: ["is carried out, line", "wird ausgeführt, Zeile"],
  carriedOut: ["has been carried out", "ist ausgeführt"],
  stoppedAt: ["ends at line", "endet an Zeile"],
  waits: ["waits", "wartet"],
  goOn: ["Go on", "Weiter"],
  giveUp: ["Stop sending", "Nicht weiter senden"],
  recordingOpen: ["A recording: go back and forth in it with the time line.", "Eine Aufzeichnung: Die Zeitachse führt darin vor und zurück."],
  tours: ["Guided tours", "Rundgänge"],
  tour: ["Guided tour", "Rundgang"],
  chooseTour: ["Take a guided tour", "Einen Rundgang machen"],
  step: ["Step", "Schritt"],
  of: ["of", "von"],
  done: ["done", "erledigt"],
  tourEnd: ["That was the whole tour. Everything that you did is still here: go back in it, or share it.", "Das war der ganze Rundgang. Alles, was du getan hast, ist noch da: Geh darin zurück oder teile es."],
  leaveTour: ["Leave the tour", "Rundgang verlassen"],
  nextStep: ["Next", "Weiter"],
  previousStep: ["Previous", "Zurück"],
  showMe: ["Write it for me", "Schreib es für mich"],
  real: ["A real controller", "Eine echte Steuerung"],
  connect: ["Connect …", "Verbinden …"],
  disconnect: ["Disconnect", "Trennen"],
  full: [
    "More was said than the page keeps: what came last is not in a recording.",
    "Es wurde mehr gesagt, als die Seite behält: Das Letzte fehlt in einer Aufzeichnung.",
  ],
  baud: ["Baud rate", "Baudrate"],
  noSerial: [
    "This browser cannot open serial ports. Chromium, Chrome and Edge can, and Firefox from version 151.",
    "Dieser Browser kann keine seriellen Schnittstellen öffnen. Chromium, Chrome und Edge können es, und Firefox ab Version 151.",
  ],
  realAbout: [
    "Every line goes to the controller at a serial port and to the virtual one, and what differs is marked. Nothing leaves this computer.",
    "Jede Zeile geht an die Steuerung an einer seriellen Schnittstelle und an die virtuelle; was abweicht, ist markiert. Nichts verlässt diesen Rechner.",
  ],
  danger: [
    "A real machine moves for real. Stay at its emergency stop; begin with lines that move nothing, such as",
    "Eine echte Maschine bewegt sich wirklich. Bleib an ihrem Not-Halt; beginne mit Zeilen, die nichts bewegen, etwa",
  ],
  understood: ["I am at the machine", "Ich bin an der Maschine"],
  toBoth: ["Send to both", "An beide senden"],
  lineForBoth: ["Line for both controllers", "Zeile für beide Steuerungen"],
  breakBoth: ["Stop both (253)", "Beide anhalten (253)"],
  sent: ["Sent", "Gesendet"],
  realSays: ["Real", "Echt"],
  virtualSays: ["Virtual", "Virtuell"],
  difference: ["Difference", "Abweichung"],
  same: ["same", "gleich"],
  bytesDiffer: ["other bytes", "andere Bytes"],
  timesDiffer: ["other time", "andere Zeit"],
  noAnswerYet: ["no answer yet", "noch keine Antwort"],
  wouldExplain: ["would explain it", "würde es erklären"],
  portGone: ["The port is gone", "Die Schnittstelle ist weg"],
  comparison: ["Comparison, line by line", "Vergleich, Zeile für Zeile"],
  tolerance: ["Answers count as equally late within 50 ms or a hundredth of the time.", "Antworten gelten innerhalb von 50 ms oder einem Hundertstel der Zeit als gleich spät."],
  here: ["runs in this page", "läuft in dieser Seite"],
  loading: ["The controllers are being fetched …", "Die Steuerungen werden geholt …"],
  broken: ["The controllers could not begin", "Die Steuerungen konnten nicht beginnen"],
  licences: ["Licences", "Lizenzen"],
  offline: ["works offline", "funktioniert ohne Netz"],
  private: ["Nothing that you do here leaves your computer.", "Nichts, was du hier tust, verlässt deinen Rechner."],
} as const satisfies Record<string, Pair>;

export type Word = keyof typeof TABLE;

export function tell(word: Word): string {
  return inLanguage(TABLE[word]);
}
