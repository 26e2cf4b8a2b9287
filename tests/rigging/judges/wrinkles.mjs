// node wrinkles.mjs NODE_MODULES BROWSER FOLDER WEIGHTS SIZE: draws rigs in a folder with three.js, with shapes at weights (JSON):
// smooth.glb without and with its maps, and folded.glb, whose mesh has the wrinkles, into smooth.png, maps.png and folded.png.
import { createRequire } from "node:module";
import { createServer } from "node:http";
import { readFileSync, writeFileSync } from "node:fs";
const [, , modules, browser, folder, weights, size] = process.argv;
const puppeteer = createRequire(`${modules}/`)("puppeteer-core");
const page = `<!doctype html><script type="importmap">{"imports": {"three": "/modules/three/build/three.module.js"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "/modules/three/examples/jsm/loaders/GLTFLoader.js";
import { addWrinkles } from "/smooth_wrinkles.js";
const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true, antialias: true });
renderer.setSize(${size}, ${size});
const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(14, 1, 0.01, 10);
const lamp = new THREE.DirectionalLight(0xffffff, 3);
lamp.position.set(-0.9, 1.3, 0.8);
scene.add(lamp, new THREE.AmbientLight(0xffffff, 0.3));
async function drawn(file, maps) {
  const { scene: head } = await new GLTFLoader().loadAsync(file), skin = head.getObjectByName("face");
  if (maps) await addWrinkles(skin, "smooth_wrinkles.json", new THREE.TextureLoader());
  head.traverse((node) => {
    for (const [name, weight] of Object.entries(${weights})) if (node.isMesh) node.morphTargetInfluences[node.morphTargetDictionary[name]] = weight;
  });
  if (!camera.position.z) { // all are seen by the same camera
    const box = new THREE.Box3().setFromObject(skin), middle = box.getCenter(new THREE.Vector3()), tall = box.getSize(new THREE.Vector3()).y;
    camera.position.set(middle.x, middle.y + 0.12 * tall, box.max.z + 2.2 * tall);
    camera.lookAt(middle.x, middle.y + 0.12 * tall, middle.z);
  }
  scene.add(head);
  renderer.render(scene, camera);
  scene.remove(head);
  return renderer.domElement.toDataURL().split(",")[1];
}
window.found = { smooth: await drawn("smooth.glb"), maps: await drawn("smooth.glb", true), folded: await drawn("folded.glb") };
</script>`;
const types = { js: "text/javascript", json: "application/json", png: "image/png" };
const server = createServer(({ url }, answer) => {
  const path = url.startsWith("/modules/") ? modules + url.slice(8) : folder + url;
  answer.setHeader("Content-Type", url === "/" ? "text/html" : types[url.split(".").at(-1)] ?? "application/octet-stream");
  try { answer.end(url === "/" ? page : readFileSync(path)); } catch { answer.writeHead(404).end(); }
}).listen(0, "127.0.0.1");
const options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const chromium = await puppeteer.launch({ executablePath: browser, args: options });
try {
  const tab = await chromium.newPage(), said = [];
  tab.on("pageerror", (error) => said.push(error.message));
  tab.on("console", (message) => { if (message.type() === "error" && !/404/.test(message.text())) said.push(message.text()); });
  await tab.goto(`http://127.0.0.1:${server.address().port}/`);
  await tab.waitForFunction("window.found", { timeout: 120000 }).catch((error) => said.push(error.message));
  for (const [name, data] of Object.entries(await tab.evaluate("window.found ?? {}"))) writeFileSync(`${folder}/${name}.png`, Buffer.from(data, "base64"));
  console.log(JSON.stringify({ said }));
} finally {
  await chromium.close();
  server.close();
}
