"""The engine: model, state, neighbours and the loop. It knows abstract parts only."""
