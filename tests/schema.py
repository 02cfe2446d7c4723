"""Which of some values a JSON Schema takes: reads {"schema": …, "values": [[name, value], …]}, prints {name: what is wrong with it, or null}."""

import json
import sys

import jsonschema

given = json.load(sys.stdin)
jsonschema.Draft7Validator.check_schema(given["schema"])
validator = jsonschema.Draft7Validator(given["schema"])
said = {}
for name, value in given["values"]:
    wrong = jsonschema.exceptions.best_match(validator.iter_errors(value))
    said[name] = wrong and f"{wrong.json_path}: {wrong.message}"
json.dump(said, sys.stdout)
