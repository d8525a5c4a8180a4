// Starts Swagger UI on this service's own OpenAPI document; nothing is asked of any other host.

// Writes a value into nested objects, which are made where they are missing.
function put(target, path, value) {
  const inside = path.slice(0, -1).reduce((object, key) => (object[key] ??= {}), target);
  inside[path.at(-1)] = value;
}

// Returns a union of all processes as the names of its members: a page with the fields of all takes half a minute.
function shortened(schema) {
  if (!schema.discriminator) return schema;
  const names = schema.oneOf.map(({ $ref }) => $ref.split("/").at(-1));
  return { type: "object", description: `By \`process\` one of these, under Schemas: ${names.join(", ")}.` };
}

// Returns the document with nothing but the part at `path`, and the components to which this part refers.
function documentOf(whole, path) {
  const kept = { ...whole, paths: {}, components: {} };
  const follow = (value) => {
    if (typeof value !== "object" || value === null) return;
    const [, kind, name] = /^#\/components\/(.*)\/(.*)$/.exec(value.$ref) ?? [];
    if (kind && !kept.components[kind]?.[name]) {
      const component = shortened(whole.components[kind][name]);
      put(kept.components, [kind, name], component);
      follow(component);
    }
    Object.values(value).forEach(follow);
  };
  const part = path.reduce((object, key) => object?.[key], whole);
  if (part) {
    const own = shortened(part);
    put(kept, path, own);
    follow(own);
  }
  return kept;
}

// Swagger UI resolves the references of an operation in the whole document, which takes seconds. It resolves the keys
// when it starts.
function ResolvePartAlone({ fn: { resolveSubtree } }) {
  return {
    fn: { resolveSubtree: (whole, path, options) => resolveSubtree(documentOf(whole, path), path, options) },
  };
}

/* global SwaggerUIBundle */
SwaggerUIBundle({
  url: "openapi.json",
  dom_id: "#swagger-ui",
  presets: [SwaggerUIBundle.presets.apis],
  plugins: [ResolvePartAlone],
  layout: "BaseLayout",
  deepLinking: true,
  defaultModelsExpandDepth: 0,
  displayRequestDuration: true,
  validatorUrl: null,
});
