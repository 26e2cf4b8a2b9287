// node validate.mjs NODE_MODULES FILE: prints what Khronos' glTF validator finds, as JSON.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";
const [, , modules, file] = process.argv;
const validator = createRequire(`${modules}/`)("gltf-validator");
const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 20 });
console.log(JSON.stringify(report.issues));
