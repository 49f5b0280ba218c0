// All words of the page, in each language. What the server tells is English, and said to be so.
import { recall, keep } from "./kept";

const TABLE = {
  // the page
  controllers: ["Controllers", "Steuerungen"],
  connected: ["connected", "verbunden"],
  lost: ["connection lost, trying again …", "Verbindung verloren, neuer Versuch …"],
  noAnswer: ["the server does not answer", "der Server antwortet nicht"],
  language: ["Language", "Sprache"],
  colours: ["Colours", "Farben"],
  system: ["as the system", "wie das System"],
  light: ["light", "hell"],
  dark: ["dark", "dunkel"],
  apiPage: ["Control API", "Steuer-API"],
  licences: ["Licences", "Lizenzen"],
  skip: ["To the front panel", "Zum Bedienfeld"],
  tokenTitle: ["This server wants a token", "Dieser Server verlangt ein Token"],
  tokenAbout: ["It is the one that serve was given.", "Es ist das, mit dem serve gestartet wurde."],
  token: ["Token", "Token"],
  enter: ["Enter", "Anmelden"],
  close: ["Close", "Schließen"],
  notDone: ["Nothing has changed", "Nichts hat sich geändert"],
  // the machine
  machine: ["Machine", "Maschine"],
  view: ["View", "Ansicht"],
  isometric: ["Isometric", "Isometrisch"],
  top: ["Top XY", "Oben XY"],
  front: ["Front XZ", "Vorn XZ"],
  side: ["Side YZ", "Seite YZ"],
  fit: ["Fit", "Einpassen"],
  clearPath: ["Clear path", "Weg löschen"],
  legend: ["Legend", "Legende"],
  feed: ["feed", "Vorschub"],
  rapid: ["rapid", "Eilgang"],
  arc: ["arc", "Bogen"],
  reference: ["reference", "Referenz"],
  older: ["older, thinned", "älter, ausgedünnt"],
  thinned: ["corners of the older path are left out", "Ecken des älteren Weges sind ausgelassen"],
  coarse: ["drawn coarsely while it moves", "grob gezeichnet, solange es sich bewegt"],
  no3d: [
    "This browser has no WebGL, so the machine is not drawn. All figures are beside it.",
    "Dieser Browser hat kein WebGL, die Maschine wird nicht gezeichnet. Alle Werte stehen daneben.",
  ],
  drawing: ["Drawing of the machine and its path", "Zeichnung der Maschine und ihres Weges"],
  // axes
  axes: ["Axes", "Achsen"],
  axis: ["Axis", "Achse"],
  units: ["Units", "Einheiten"],
  position: ["Position", "Position"],
  carriage: ["Carriage", "Schlitten"],
  speed: ["Speed", "Geschwindigkeit"],
  steps: ["steps", "Schritte"],
  referenced: ["referenced", "referenziert"],
  notReferenced: ["not referenced", "nicht referenziert"],
  // front panel
  panel: ["Front panel", "Bedienfeld"],
  mains: ["Mains", "Netz"],
  powerOff: ["Switch off", "Ausschalten"],
  powerOn: ["Switch on", "Einschalten"],
  on: ["ON", "EIN"],
  start: ["START", "START"],
  stop: ["STOP", "STOP"],
  "cover-button": ["COVER", "HAUBE"],
  estop: ["E-STOP", "NOT-HALT"],
  estopHeld: ["EMERGENCY STOP", "NOT-HALT"],
  estopHold: ["press the emergency stop", "Not-Halt drücken"],
  estopRelease: ["release the emergency stop", "Not-Halt lösen"],
  pressed: ["pressed", "gedrückt"],
  key: ["Key", "Schlüssel"],
  cover: ["Cover", "Haube"],
  open: ["open", "offen"],
  closed: ["closed", "zu"],
  test: ["test", "Test"],
  auto: ["auto", "Auto"],
  // ports
  ports: ["Ports and inputs", "Ports und Eingänge"],
  outputs: ["Outputs", "Ausgänge"],
  inputs: ["Inputs", "Eingänge"],
  output: ["output", "Ausgang"],
  port: ["Port", "Port"],
  bit: ["bit", "Bit"],
  set: ["Set", "Setzen"],
  // time line
  timeline: ["Time line", "Zeitachse"],
  branches: ["Branches", "Zweige"],
  previousEntry: ["Previous entry", "Voriger Eintrag"],
  nextEntry: ["Next entry", "Nächster Eintrag"],
  toPresent: ["To the present", "In die Gegenwart"],
  takeOver: ["Go on from here", "Von hier aus weiter"],
  goOn: ["Leave the past", "Vergangenheit verlassen"],
  isPast: ["This is past. The controller is paused.", "Das ist Vergangenheit. Die Steuerung ist angehalten."],
  pausedNow: ["The present. The controller is paused.", "Die Gegenwart. Die Steuerung ist angehalten."],
  dragBack: ["Go back to see the past; the controller is paused meanwhile.", "Zurückgehen zeigt die Vergangenheit; die Steuerung ist so lange angehalten."],
  noPast: ["This program keeps no past to look at; moments can be kept instead.", "Dieses Programm behält keine Vergangenheit; statt dessen lassen sich Momente festhalten."],
  film: ["A recording. Between its entries axes are shown to move evenly.", "Eine Aufzeichnung. Zwischen ihren Einträgen bewegen sich die Achsen gleichmäßig."],
  filmThinned: ["A long recording: not every moment of it is kept exactly.", "Eine lange Aufzeichnung: Nicht jeder Moment ist genau enthalten."],
  leftOut: ["earlier entries are left out", "frühere Einträge sind ausgelassen"],
  wentBack: ["× somebody went back, and what had come of it is left out", "× ist jemand zurückgegangen; was daraus geworden war, ist ausgelassen"],
  cutOff: ["the recording is cut off: it has no end", "die Aufzeichnung ist abgeschnitten: sie hat kein Ende"],
  leaves: ["leaves", "verlässt"],
  lookAt: ["Look at this moment", "Diesen Moment ansehen"],
  // conversation
  conversation: ["Conversation", "Gespräch"],
  search: ["Search the conversation", "Gespräch durchsuchen"],
  show: ["Show", "Zeigen"],
  refused: ["Refused:", "Abgelehnt (englisch begründet):"],
  inEnglish: ["What happened is told in English.", "Was geschah, und was die Steuerung dazu sagt, steht hier auf Englisch."],
  everything: ["everything", "alles"],
  talk: ["commands and answers", "Befehle und Antworten"],
  problems: ["errors and warnings", "Fehler und Warnungen"],
  leftHere: ["The controller left this moment and goes on from another one", "Die Steuerung hat diesen Moment verlassen und macht von einem anderen aus weiter"],
  follow: ["Follow", "Mitlaufen"],
  entries: ["entries", "Einträgen"],
  of: ["of", "von"],
  earlier: ["Show earlier entries", "Frühere Einträge zeigen"],
  missing: ["entries are no longer kept", "Einträge sind nicht mehr vorhanden"],
  entry: ["Entry", "Eintrag"],
  time: ["Time", "Zeit"],
  bytes: ["Bytes", "Bytes"],
  why: ["Why", "Warum"],
  kind: ["Kind", "Art"],
  send: ["Send", "Senden"],
  sendAbout: ["Send to the controller, with CR", "An die Steuerung senden, mit CR"],
  // clock
  clock: ["Clock", "Uhr"],
  now: ["Now", "Jetzt"],
  pace: ["Pace", "Tempo"],
  real: ["real time", "Echtzeit"],
  manual: ["manual", "von Hand"],
  instant: ["instant", "sofort"],
  pause: ["Pause", "Anhalten"],
  resume: ["Resume", "Weiter"],
  step: ["Step", "Einzelschritt"],
  paused: ["paused", "angehalten"],
  waitsForResume: [
    "Time is paused: what was sent is heard after Resume or Step.",
    "Die Zeit ist angehalten: Was gesendet wurde, kommt nach Weiter oder Einzelschritt an.",
  ],
  waitsForLeaving: [
    "The controller is held while its past is looked at: what was sent is heard after Leave the past.",
    "Die Steuerung steht, solange ihre Vergangenheit betrachtet wird: Was gesendet wurde, kommt nach Vergangenheit verlassen an.",
  ],
  running: ["running", "läuft"],
  stands: ["stands still", "steht"],
  advance: ["Advance by", "Vorstellen um"],
  go: ["Go", "Los"],
  runUntil: ["Run until", "Laufen bis"],
  cancel: ["Cancel", "Abbrechen"],
  breakpoints: ["Breakpoints", "Haltepunkte"],
  condition: ["Condition", "Bedingung"],
  add: ["Add", "Hinzufügen"],
  remove: ["Remove", "Entfernen"],
  moments: ["Moments", "Momente"],
  moment: ["Moment", "Moment"],
  takeMoment: ["Keep this moment", "Diesen Moment festhalten"],
  goBack: ["Go back there", "Dorthin zurück"],
  none: ["none", "keine"],
  // program
  program: ["Stored program", "Gespeichertes Programm"],
  noProgram: ["No program is stored.", "Kein Programm gespeichert."],
  lineBack: ["A line back", "Eine Zeile zurück"],
  lineOn: ["A line on", "Eine Zeile weiter"],
  continue: ["Continue", "Weiterlaufen"],
  breakpoint: ["Breakpoint at line", "Haltepunkt an Zeile"],
  roundsLeft: ["more rounds", "weitere Runden"],
  // faults
  faults: ["Faults", "Störungen"],
  oftenUsed: ["Ready-made", "Fertige"],
  loseAnswer: ["Lose the next answer byte", "Nächstes Antwortbyte verlieren"],
  garbleAnswer: ["Garble the next answer byte", "Nächstes Antwortbyte verfälschen"],
  doubleAnswer: ["Double the next answer byte", "Nächstes Antwortbyte verdoppeln"],
  cutLine: ["Cut the line for 2 s", "Leitung 2 s unterbrechen"],
  jamAxis: ["Jam", "Blockiere"],
  powerFailure: ["Power failure of 1 s", "Netzausfall von 1 s"],
  ownFault: ["Another fault, or a rule", "Andere Störung oder eine Regel"],
  begin: ["Begin", "Beginnen"],
  end: ["End", "Beenden"],
  endAll: ["End all", "Alle beenden"],
  active: ["Active", "Aktiv"],
  times: ["times struck", "mal getroffen"],
  acted: ["times acted", "mal gewirkt"],
} as const satisfies Record<string, readonly [string, string]>;

/** What the server says in one word, where it has a German one. */
const FOREIGN: Record<string, string> = {
  off: "aus", idle: "ruht", "limit-error": "Endschalterfehler", "needs-reference": "braucht Referenzfahrt",
  "cannot-move": "kann nicht fahren", "program-stopped": "Programm angehalten",
  "starting-up": "startet", move: "fährt", arc: "fährt einen Bogen",
  "following-vectors": "fährt Vektoren", "program-move": "fährt im Programm",
  "following-trackball": "folgt der Rollkugel", "self-test": "Selbsttest",
  "reference-towards-switch": "Referenzfahrt zum Schalter", "reference-out-of-switch": "Referenzfahrt vom Schalter",
  "reference-free-steps": "Freischritte", "leaving-limit-switch": "verlässt den Endschalter",
  "waiting-for-head": "wartet auf den Kopf", settling: "kommt zur Ruhe", waiting: "wartet",
  "program-delay": "Programm wartet", "program-line": "Programmzeile",
  "program-waits-for-port": "Programm wartet auf Port", "program-waits-for-character": "Programm wartet auf Zeichen",
  "program-halted-on-itself": "Programm hält an", echo: "Echo",
  running: "läuft", valid: "gültig", invalid: "ungültig", stopped: "angehalten", command: "Befehl",
  answer: "Antwort", warning: "Warnung", motion: "Bewegung", signal: "Signal", port: "Port",
  switch: "Schalter", news: "Nachricht", line: "Zeile", ignored: "ignoriert", flash: "Flash",
  fault: "Störung", rule: "Regel", baud: "Baudrate", "cut-short": "abgebrochen", missed: "verpasst",
};

/** What the server says of a signal. */
const SIGNALS: readonly [RegExp, string][] = [
  [/^(START|STOP) button$/, "Taste $1"],
  [/^ON button of the power stage$/, "Taste EIN der Endstufe"],
  [/^button that asks to open the cover$/, "Taste, mit der das Öffnen der Haube verlangt wird"],
  [/^emergency stop, latches until released$/, "Not-Halt, rastet ein, bis er gelöst wird"],
  [/^key switch$/, "Schlüsselschalter"],
  [/^cover$/, "Haube"],
  [/^the power stages are too hot$/, "die Endstufen sind zu heiß"],
  [/^the motor supply voltage is good$/, "die Motorspannung ist in Ordnung"],
  [/^tool length probe$/, "Werkzeuglängentaster"],
  [/^negative limit switch of (\w+), held by hand$/, "negativer Endschalter von $1, von Hand gehalten"],
  [/^positive limit switch of (\w+), held by hand$/, "positiver Endschalter von $1, von Hand gehalten"],
  [/^user input (\d+)$/, "Anwendereingang $1"],
  [/^the axis that the trackball moves$/, "die Achse, die die Rollkugel bewegt"],
  [/^turns the trackball by so many steps$/, "dreht die Rollkugel um so viele Schritte"],
  [/^the spindle unit does not reach its speed, and says 1 or 2$/, "die Spindel erreicht ihre Drehzahl nicht und meldet 1 oder 2"],
  [/^message interrupt (\d)$/, "Meldeinterrupt $1"],
  [/^takes the measured positions$/, "übernimmt die gemessenen Positionen"],
  [/^serial channel (\w) is not ready$/, "serieller Kanal $1 ist nicht bereit"],
  [/^error in block (\d) of the processor's memory$/, "Fehler in Block $1 des Prozessorspeichers"],
  [/^error in the external data memory$/, "Fehler im externen Datenspeicher"],
  [/^error in the external program memory$/, "Fehler im externen Programmspeicher"],
  [/^received a byte with wrong parity$/, "ein Byte mit falscher Parität empfangen"],
  [/^received a byte without stop bit$/, "ein Byte ohne Stoppbit empfangen"],
  [/^work area left$/, "Arbeitsbereich verlassen"],
  [/^limit switch hit$/, "Endschalter angefahren"],
  [/^the sum of all error signals is set$/, "die Sammelmeldung aller Fehler ist gesetzt"],
  [/^power stage of (\w+) failed$/, "Endstufe von $1 ausgefallen"],
  [/^a power stage failed$/, "eine Endstufe ist ausgefallen"],
  [/^limit switch of (\w+) failed$/, "Endschalter von $1 ausgefallen"],
  [/^a limit switch failed$/, "ein Endschalter ist ausgefallen"],
  [/^air pressure too low$/, "Luftdruck zu niedrig"],
  [/^reference point of (\w+) hit$/, "Referenzpunkt von $1 angefahren"],
  [/^a reference point hit$/, "ein Referenzpunkt angefahren"],
  [/^the interface has no joystick$/, "an der Schnittstelle ist kein Joystick"],
  [/^a command was begun and not ended in time$/, "ein Befehl wurde begonnen und nicht rechtzeitig beendet"],
  [/^a module no longer identifies itself$/, "ein Modul meldet sich nicht mehr"],
];

export type Word = keyof typeof TABLE;
export const LANGUAGES = ["en", "de"] as const;
export type Language = (typeof LANGUAGES)[number];

/** The language that was chosen, or that the browser wants. */
export function language(): Language {
  const chosen = recall("language") ?? navigator.language.slice(0, 2);
  return chosen === "de" ? "de" : "en";
}

export function speak(chosen: Language): void {
  keep("language", chosen);
}

/** Of a text in each language, that in the language of the page. */
export function inLanguage(texts: readonly [string, string]): string {
  return texts[LANGUAGES.indexOf(language())] ?? texts[0];
}

/** A word in the language of the page. */
export function say(word: Word): string {
  return inLanguage(TABLE[word]);
}

/** A word of the server in the language of the page. */
export function translated(word: string): string {
  return (language() === "de" && FOREIGN[word]) || word.replaceAll("-", " ");
}

/** What a signal is for, in the language of the page. */
export function explained(about: string): string {
  const known = language() === "de" && SIGNALS.find(([english]) => english.test(about));
  return known ? about.replace(...known) : about;
}

/** The page's own word for a name of the server, where it has one. */
export function named(name: string): string {
  return name in TABLE ? say(name as Word) : name;
}

/** A number as people of the language write it. */
export function figure(value: number, decimals = 0): string {
  return value.toLocaleString(language(), {
    minimumFractionDigits: decimals,
    maximumFractionDigits: decimals,
  });
}

/** A model time, in seconds. */
export function seconds(nanoseconds: number, decimals = 3): string {
  return `${figure(nanoseconds / 1e9, decimals)} s`;
}
