"""The result of proofs."""

from __future__ import annotations

from grazemap.schema.fields import ResultSchema, field

PROOFS = ResultSchema(
    "Proof",
    "The proof or the disproof of a statement, as a certificate.",
    (
        field(
            "kind",
            "str",
            "What is stated.",
            values=("orbit", "attraction", "bifurcation", "codimension-two"),
        ),
        field(
            "verdict",
            "str",
            "proven or disproven, if the checker accepts the certificate; else undecided.",
            values=("proven", "disproven", "undecided"),
        ),
        field("reason", "str", "Why it is undecided, and at which precision or limit of time.", null=True),
        field(
            "limited",
            "bool",
            "Whether the limit of time ended the search; then it is made again when it is asked for again.",
        ),
        field("certificate", "str", "The certificate, as JSON.", variable=None),
        field("shown", "str", "What the checker shows besides the statement, by name, as JSON.", variable=None),
    ),
    process="proofs",
)
