"""What only the book needs: the ledger, figures to publish, diagrams.

The chapters import it as `book.companion`, beside the package `armlock`; no wheel holds it.
"""
