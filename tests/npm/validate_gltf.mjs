// Prints the glTF validator's report on a file, as JSON.
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

console.log(JSON.stringify(await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])))));
