// The page's words: where a message of the program names an option or another command, the page names its own field or tab.

/** What the program writes, and what it is here; the first that fits counts. */
/** @type {[RegExp, string][]} */
const WORDS = [
  [/delta-cal plan \S+ --samples [^,;]* --count \d+/g, "Plan, with more measurements"],
  [/delta-cal import and delta-cal plan --measure plane write one to fill in/g, "plan touches of the bed, or type heights into a table"],
  [/delta-cal plan with --count 16 writes the [\w -]+? commands/g, "the tab Plan writes the commands"],
  [/the commands of delta-cal plan/g, "the commands of the tab Plan"],
  [/delta-cal import writes a robot file; plan for that, with --measure plane/g, "write a robot file under New robot, and plan heights for that"],
  [/use delta-cal import reprapfirmware or delta-cal import marlin/g, "choose the firmware under Options"],
  [/that of delta-cal import/g, "as calibrated"],
  [/use delta-cal import (\w+)/g, "choose the firmware $1 under Options"],
  [/delta-cal import makes a robot file of it/g, "drop it by itself"],
  [/`?delta-cal init --output -`? prints a robot file with every key \(with towers, add --kind linear\)/g, "New robot writes a robot file"],
  [/`delta-cal simulate --example` prints a campaign file with every key/g, "Simulate writes a campaign file"],
  [/delta-cal init(?: writes)?/g, "New robot"],
  [/`?calibrate --frame sensor`? (finds|writes)/g, "a calibration with “Frame: the sensor's own” $1"],
  [/`?validate --frame sensor`?/g, "Validate with the sensor's frame"],
  [/\(--frame sensor\)/g, "(the sensor's own)"],
  [/Use --frame sensor/g, "Choose “Frame: the sensor's own” under Options"],
  [/(?:use |with )?`?--frame sensor`?/g, "choose “Frame: the sensor's own” under Options"],
  [/state --shrinkage/g, "state the shrinkage of prints under Options"],
  [/\(--shrinkage\)/g, "(state it under Options)"],
  [/--shrinkage/g, "Shrinkage of prints"],
  [/\(--rods(?: [\d.±]+mm)?\)/g, "(Rods, under Options)"],
  [/: --rods ([\d.±]+)mm/g, " under Options as $1"],
  [/\(--printed (\d+=[\d.]+)\)/g, "(under Options, as $1)"],
  [/--printed (\d+=[\d.]+)/g, "$1 under Options"],
  [/--printed/g, "Printed lengths"],
  [/--rods/g, "Rods (Options)"],
  [/copy it beside the configuration and import again/g, "add it to the files here"],
  [/copy (config-override\.g) from the controller's card beside this file; if there is none, delete M501 from this copy/g, "drop $1 from the controller's card here too; if there is none, delete M501 in the editor"],
  [/\. No file was changed$/g, ""],
  [/--radius/g, "Delta radius"],
  [/--robust leaves/g, "“Leave out and name samples that disagree” under Options leaves"],
  [/leave out --robust/g, "switch off “Leave out and name samples that disagree”"],
  [/--robust/g, "“Leave out and name samples that disagree”"],
  [/--method (\w+)/g, "the method $1 under Options"],
  [/(?:as |with )?--columns ([^\s,;.)]+)/g, "“Other column names” under Options, $1"],
  [/which --columns names/g, "which “Other column names” names"],
  [/--columns/g, "“Other column names” under Options"],
  [/--count must be/g, "the number of measurements must be"],
  [/--count/g, "number of measurements"],
  [/--measure/g, "the instrument"],
  [/--nominal/g, "Robot before calibration"],
  [/--positions/g, "Positions to fit at"],
  [/--limit/g, "limit"],
  [/--home/g, "End stops"],
  [/--bed/g, "Heights of the bed"],
  [/--for/g, "Controller"],
  [/--rows \S+/g, "in a file of their own"],
  [/--json lists all/g, "the JSON lists all"],
  [/`?delta-cal calibrate`? finds/g, "a calibration finds"],
  [/only files that delta-cal calibrated/g, "only calibrated files"],
];

/**
 * @param {string} text
 * @returns {string}
 */
export function inPageWords(text) {
  return WORDS.reduce((own, [command, page]) => own.replace(command, page), text);
}

/** Options of the command that a message may name, and the fields that they are here, with the value that helps. */
/** @type {[string, string, string, (string | boolean)?][]} */
export const FIELDS = [
  ["--frame sensor", "frame", "Positions in the sensor's frame", "sensor"],
  ["--robust", "robust", "Leave out samples that disagree", true],
  ["--method fkm", "method", "Method FKM", "fkm"],
  ["--rods", "rods", "State the rods' length"],
  ["--radius", "radius", "State the delta radius"],
  ["--printed", "printed", "State a printed length"],
  ["--shrinkage", "shrinkage", "State the shrinkage"],
  ["--columns", "columns", "State the columns"],
  ["delta-cal import reprapfirmware", "firmware", "Say which firmware"],
];

/** Messages without measurements: what to do about that here. */
export const WITHOUT_MEASUREMENTS = /saves no measurements|holds no saved measurements|given without its samples|heights without places|where you touched|Touch the bed at/;
