"""Collections: what is asked of mechanisms of another kind, which a plugin brings.

May import `collection`, `problem`, `store` and what lies below.
"""
